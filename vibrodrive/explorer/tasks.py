"""Tasks of the worker for a page, one for each rank (worker.py), and the display of their results.

Tasks run in the worker thread. Every change of the page runs in the server thread (`Session.later`). `seq` is the
number of the page's message that requested the task.
"""

from __future__ import annotations

import base64
import html
import json
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from typing import Any

from vibrodrive.explorer import exact, export
from vibrodrive.explorer.controls import GROUPS, symbol
from vibrodrive.explorer.engine import KEPT, Engine
from vibrodrive.explorer.image import fitting_range, pictures
from vibrodrive.explorer.layout import CURVES, LOOKS, key_of_lines
from vibrodrive.explorer.motion import Motion, forces, lines, motion_at, warm, words
from vibrodrive.explorer.session import Session, overlay_of
from vibrodrive.explorer.shown import counted, picture_of, place, title_of
from vibrodrive.explorer.view import BESIDE, View
from vibrodrive.explorer.work import Level, Work
from vibrodrive.explorer.worker import Rank
from vibrodrive.jit.slices import Halt
from vibrodrive.model.choices import Method
from vibrodrive.model.drawing import MAP
from vibrodrive.model.names import LINEAR
from vibrodrive.model.size import result_bytes
from vibrodrive.periodic.search import kind_of

REST_SECONDS = 0.12  # pause between the first picture and finer pictures; a moving mouse sends the next request earlier
PENDING = "multiplier and k₂ are being computed …"
SOUGHT = "exact curves are being computed"


def work_of(session: Session, view: View) -> Work:
    """Return the `Work` of the sweep of a view. If the `Work` of the session is for another sweep, create a new
    `Work`."""
    views = [view, view.certified()] if view.compared else [view]
    made_from = [v.toml().partition("\n[figure]")[0] for v in views]
    work = session.work
    if work is None or made_from != session.made_from:
        session.work = None  # free the old arrays before new ones are allocated
        session.made_from = made_from
        plans = [v.plan() for v in views]
        session.engine.make_room(sum(map(result_bytes, plans)), f"periods = {view.periods}")
        work = session.work = Work(plans, session.engine.threads)
    return work


def show_picture(session: Session, view: View, seq: int, halt: Halt) -> None:
    """Draw the diagram or map of a view, first coarse, then finer."""
    for count, level in enumerate(work_of(session, view).levels(session.engine.pace, halt)):
        if count == 0 or level.complete or not session.unpainted:  # no finer picture while another is not yet sent
            _draw(session, view, seq, level)
        if count == 0 and not level.complete:
            session.engine.worker.pause(halt, REST_SECONDS)
    latest = session.sized(session.view)  # differs from `view` at most in `at`, which a click sets
    if latest.follows:
        session.follow(halt, Rank.MOTION, latest, seq)
    else:
        session.follow(halt, Rank.EXACT, latest, None, [])


def _draw(session: Session, view: View, seq: int, level: Level) -> None:
    # `address` is that of the latest view. If the latest view differs from `view` in more than `at`, the page ignores
    # `address`.
    head: dict[str, Any] = {"seq": seq, "complete": level.complete, "address": session.view.address(), "odd": {}}
    head["numbers"] = {c.name: getattr(view, c.name) for group in GROUPS.values() for c in group if c.slider}
    over, conditions = title_of(view)
    head["title"] = f"<b>{over}</b>, {conditions}"
    p = picture_of(view, level, session.pixels[1])
    said, meaning = counted(level, p.odd), f"<br>{p.key.html()}"
    if not level.complete:
        said = f"{100 * level.share:.0f} % of the sweep"
        if level.sketch is not None:
            s = level.sketch.results[0].settings
            said += f"; the rest is a sketch with {s.transient} + {s.periods} periods"
    else:
        head["odd"] = p.odd
    if p.fit:
        head["fit"] = [p.y, p.y + p.dh]
    if view.mode != MAP and not any(image.any() for image in p.images):
        said = "No value is in this window: press Follow. " + said
    if view.compared and view.compare == BESIDE:
        said += f" · above: {view.method}, below: certified"
    head["status"] = said + meaning
    head["note"] = session.key_of_overlay()
    if level.complete and overlay_of(view) not in (None, session.overlay):
        head["note"] = SOUGHT
    session.unpainted += 1
    place = {"x": p.x, "dw": p.dw, "y": p.y, "dh": p.dh}
    picture = {"head": json.dumps(head), "images": p.images, "palette": p.palette, **place}
    session.later(partial(_paint, session, picture))


def _paint(session: Session, picture: dict[str, Any]) -> None:
    session.unpainted = 0
    session.send("picture", picture)


def show_motion(session: Session, view: View, seq: int, halt: Halt) -> None:
    """Show the curves of the motion at `view.at` and its description."""
    motion = motion_at(view, halt)
    said = [*words(motion, view), key_of_lines(CURVES)]
    columns, drives = lines(motion.trajectory), forces(motion.trajectory)

    def show() -> None:
        if not session.view.follows:  # the view has changed since the computation began
            return
        session.send("forces", drives)
        session.page.motion.data = {**columns, "colour": [colour for colour, _ in CURVES]}
        news = {"words": "<br>".join([*said, PENDING]), "column": float(place(motion.x, view.scale))}
        session.notify({**news, "address": session.view.address(), "done": seq})

    session.later(show)
    session.follow(halt, Rank.EXACT, view, motion, said)


def show_exact(session: Session, view: View, motion: Motion | None, said: list[str], halt: Halt) -> None:
    """Compute the exact results for a view and its motion, in the background."""
    call = partial(session.engine.aside.call, halt)
    if motion is None:  # before the first click, load the kernels of a motion in both processes
        with suppress(RuntimeError):  # if the other process fails, the error is shown after the next click
            call(warm)  # compile in the other process: compilation here would delay the next picture
        warm()
    else:
        show_limits(session, motion, said, halt)
    wanted = overlay_of(view)
    if wanted is None:
        return
    if wanted == session.overlay:  # these curves are already shown
        session.later(session.show_key)
        return
    window = view.low, view.high, view.incline, view.orbits, view.quantity, view.section_phase
    session.later(partial(_lay_over, session, view, *call(exact.orbit_lines, *window)))


def show_limits(session: Session, motion: Motion, said: list[str], halt: Halt) -> None:
    """Add the exact results for a motion to the lines `said` of its description. Report to the page if its structure,
    the pattern of its impacts, is lost."""
    known, losses = list(said), []
    try:
        for line, lost in exact_words(session.engine, halt, motion):
            known.insert(1 + len(known) - len(said), line)  # before the details of the motion
            losses += [line] if lost else []
            session.later(partial(session.notify, {"words": "<br>".join([*known, PENDING])}))
    finally:
        if not halt.called:  # also after an error, which is shown above the diagram
            session.later(partial(session.notify, {"words": "<br>".join(known), "lost": "; ".join(losses)}))


def _lay_over(session: Session, view: View, lines: list[exact.Curve], marks: list[exact.Curve]) -> None:
    if not session.belongs(overlay_of(view)):  # the view has changed since the computation began
        return
    unit = view.measure(view.quantity).of(1.0)
    for source, curves in ((session.page.lines, lines), (session.page.marks, marks)):
        looks = zip(*(LOOKS[c.kind] for c in curves), strict=True) if curves else ((), (), ())
        source.data = {
            "x": [place(c.x, view.scale) for c in curves],
            "y": [place(c.y * unit, LINEAR) for c in curves],
            "A": [repr(c.x) if isinstance(c.x, float) else "" for c in curves],
            "kind": [c.kind for c in curves],
            "period": [c.period for c in curves],
            **dict(zip(("colour", "width", "dash"), map(list, looks), strict=True)),
        }
    session.overlay = overlay_of(view)
    session.show_key()


def send_file(session: Session, view: View, kind: str, halt: Halt) -> None:
    """Send a view, or its motion, as a file of one of KINDS."""
    if kind in ("toml", "py"):
        content = (view.toml() if kind == "toml" else export.python(view)).encode()
    elif kind == "csv":
        if not view.follows:
            raise ValueError("no motion is selected: click a column of a diagram first")
        content = export.motion_table(motion_at(view, halt).trajectory).encode()
    else:
        *_, level = work_of(session, view).levels(session.engine.pace, halt)
        if kind == "h5":
            content = export.result_file(view, level.sweep.results[0])
        else:
            content = export.drawn(view, picture_of(view, level, session.pixels[1]), session.page, kind)
    file = {"name": export.file_name(view, kind), "base64": base64.b64encode(content).decode()}
    session.later(partial(session.notify, {"file": file}))


TASKS: dict[Rank, Callable[..., None]] = {
    Rank.MOTION: show_motion,
    Rank.PICTURE: show_picture,
    Rank.EXPORT: send_file,
    Rank.EXACT: show_exact,
}
"""Task of each rank. Its arguments are the session, the arguments of the request, and the flag that halts the task."""


def warm_picture(engine: Engine, halt: Halt) -> None:
    """Run a small sweep to load all modules and kernels that the first picture needs."""
    view = View.read({"columns": 200})
    for level in Work([view.plan()], engine.threads).levels(engine.pace, halt):
        pictures(level, view.quantity, *fitting_range(level, view.quantity))


def exact_words(engine: Engine, halt: Halt, motion: Motion) -> Iterator[tuple[str, bool]]:
    """Yield lines with the exact results for a motion, each with True if the line reports that the structure is lost.

    The results are the multiplier and the limits of the motion, and the comparison of its disturbances with the limits.
    """
    known = motion.trajectory.arguments
    period, phases = motion.summary["period"], motion.trajectory.impacts["phase"]
    if known["eps"] == 0.0 and period > 0:
        multiplier = engine.aside.call(halt, exact.multiplier_at, known["A"], known["B"], period, phases)
        if multiplier == multiplier:
            yield f"multiplier {multiplier:.10g}: {kind_of(multiplier)}", False
    method = Method(known["method"])
    arguments = {name: known[name] for name in ("A", "B", "eta", "xi0", "dxi0", "tau0")}
    whose = "" if method == Method.CERTIFIED and known["eps"] == 0.0 else " of the certified, undisturbed motion"
    wanted = [("eps", whose, arguments | {"disturbance": "eps"})]
    if method != Method.CERTIFIED:
        of_step = {"disturbance": "dtau", "method": method.name.lower(), "eps": known["eps"]}
        wanted.append(("dtau", f" of the method {method.name.lower()}", arguments | of_step))
    for name, whose, arguments in wanted:
        key = str(arguments)
        if key not in engine.limits:
            if len(engine.limits) == KEPT:
                del engine.limits[next(iter(engine.limits))]  # the oldest entry
            engine.limits[key] = engine.aside.call(halt, exact.limit_at, arguments)
        k2, velocity, how, last_kept = (engine.limits[key][part] for part in ("k2", "velocity", "how", "last_kept"))
        value = f"{k2:.4g} (as a velocity {velocity:.4g}): " if k2 == k2 else ""
        yield f"k₂ in {symbol(name)}{whose}: {value}{html.escape(how)}", False
        if k2 == k2 and known[name] > 0.0:
            sentence, lost = compared_with_limit(symbol(name), known[name], k2, last_kept)
            yield f"<b>{sentence}</b>", lost


def compared_with_limit(name: str, value: float, k2: float, last_kept: float) -> tuple[str, bool]:
    """Return a sentence that compares the disturbance `value` with the limit k2 of its motion, and True if the
    structure is lost. From k2 to `last_kept` some values keep the structure; above `last_kept` it counts as lost."""
    if value < k2:
        return f"your {name} = {value:.3g} is {value / k2:.2g} of the limit: the structure is kept", False
    lost = value > last_kept
    said = "the structure is lost" if lost else "some such values keep the structure, others lose it"
    return f"your {name} = {value:.3g} is {value / k2:.3g} times the limit: {said}", lost
