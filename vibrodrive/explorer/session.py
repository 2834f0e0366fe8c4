"""One open page: what it asks for, computed by the worker, and what it is told."""

from __future__ import annotations

import base64
import html
import itertools
import json
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from typing import Any
from urllib.parse import parse_qsl

import numpy as np
from bokeh.document import Document

from vibrodrive.explorer import exact, export
from vibrodrive.explorer.aside import Aside
from vibrodrive.explorer.image import difference, fitting_range, ink_palette, pictures
from vibrodrive.explorer.layout import CURVE_COLOURS, KIND_COLOURS, NO_CURVES, NO_LINES, NO_MARKS, build
from vibrodrive.explorer.motion import Motion, lines, motion_at, words
from vibrodrive.explorer.plane import painted
from vibrodrive.explorer.view import DIAGRAM, DIFFERENCE, DIMENSIONLESS, ENDS, LOG, SI, SPAN, Y_SPAN, View
from vibrodrive.explorer.work import Level, Pace, Work
from vibrodrive.explorer.worker import Rank, Slot, Worker
from vibrodrive.jit.slices import Halt
from vibrodrive.model.drawing import MAP
from vibrodrive.model.physical import SCENE_AXES
from vibrodrive.periodic.search import kind_of

REST_SECONDS = 0.12
"""How long a first picture stands before finer ones are computed: while the mouse moves, the next request comes
earlier than that."""

PENDING = "multiplier and k₂ are being computed …"
"""What stands in their place."""

INK = ink_palette()
"""Of diagrams."""

NUMBERS = itertools.count()

NOBODY = -1
"""The number of no page."""


class Engine:
    """What all pages of a server share: the thread that computes, the process for exact work, and the pace."""

    def __init__(self, threads: int) -> None:
        self.threads = threads
        self.worker = Worker(self._failed)
        self.aside = Aside(exact.warm)
        self.pace = Pace()
        self.pages: dict[int, Session] = {}
        self.worker.request(Slot(NOBODY, Rank.EXPORT), self._warm)

    def _warm(self, halt: Halt) -> None:
        """Load all that the first picture and the first click need, while the browser opens the page."""
        view = View.read({"columns": 200, "at": View().low})
        for level in Work([view.plan()], self.threads).levels(self.pace, halt):
            pictures(level, view.quantity, *fitting_range(level, view.quantity))
        lines(motion_at(view, halt).trajectory)

    def _failed(self, slot: Slot, error: BaseException) -> None:
        page = self.pages.get(slot.page)
        if page is not None:
            page.failed(slot.rank, error)

    def close(self) -> None:
        self.worker.close()
        self.aside.close()


class Session:
    """A page, from when it is opened to when it is closed.

    `base` is the view that "Reset" leads to; `address` the query of the page's own address, without its token.
    """

    def __init__(self, document: Document, engine: Engine, base: View, address: str, token: str) -> None:
        self.document, self.engine, self.base = document, engine, base
        self.number = next(NUMBERS)
        self.work: Work | None = None
        self.made_from: list[str] = []
        self.view, self.seq = base, 0
        self.refused = ""
        self.unpainted = 0
        self.unheard: list[dict[str, Any]] = []
        self.overlay: Overlay | None = None
        self.numbers = itertools.count(1)
        if address:
            try:
                self.view = read_address(address)
            except ValueError as error:
                self.refused = _one_line(error)
        self.page = build(document, self.view, token)
        self.page.request.on_change("data", lambda attr, old, new: self._heard(new["message"][0]))
        engine.pages[self.number] = self
        document.on_session_destroyed(lambda context: self._closed())

    def _closed(self) -> None:
        self._left()
        self.engine.pages.pop(self.number, None)

    def _left(self) -> None:
        """Nobody looks at the page: give up its work. A browser that keeps it for "back" leaves its session open."""
        self.engine.worker.cancel(self.number)
        self.work = None

    # -- what the page says ------------------------------------------------------------------------------------

    def _heard(self, message: str) -> None:
        asked = json.loads(message)
        self.seq = asked["seq"]
        self.unheard = [item for item in self.unheard if item["number"] > asked["heard"]]
        try:
            self._answer(asked)
        except ValueError as error:
            self._tell({"refused": _one_line(error), "done": self.seq})

    def _answer(self, asked: Mapping[str, Any]) -> None:
        if asked.get("hello"):
            self._tell({"apply": self.view.state()}, {"refused": self.refused})
        elif asked.get("left"):
            self._left()
        elif asked.get("reset"):
            self._tell({"apply": self.base.state()})
        elif "address" in asked:
            self._tell({"apply": read_address(asked["address"]).state()})
        elif "changed" in asked:
            self._tell({"apply": adapted(asked["view"], asked["changed"]).state()})
        elif "dive" in asked:
            view = View.read(asked["view"])
            there = {view.y: asked["dive"], "mode": "diagram", "bottom": None, "top": None}
            self._tell({"apply": View.read(asked["view"] | there).state()})
        elif "file" in asked:
            self._request(Rank.EXPORT, partial(self._export, View.read(asked["view"]), asked["file"]))
        else:
            self._show(View.read(asked["view"]), asked.get("only_motion", False))

    def _show(self, view: View, only_motion: bool) -> None:
        """Compute a view, or the curves of its motion alone."""
        self.view, seq = view, self.seq
        wanted = overlay_of(view)
        if self.overlay and (wanted is None or wanted[0] != self.overlay[0]):
            self._clear()
        worker = self.engine.worker
        if only_motion:
            worker.cancel(self.number, Rank.EXACT)
            self._request(Rank.MOTION, partial(self._motion, view, seq))
            return
        worker.cancel(self.number, Rank.EXACT, Rank.MOTION)
        self._request(Rank.PICTURE, partial(self._picture, view, seq))

    def _follow(self, halt: Halt, rank: Rank, task: Callable[[Halt], None]) -> None:
        """Ask, from a task, for what comes after it."""
        self.engine.worker.follow(halt, Slot(self.number, rank), task)

    def _request(self, rank: Rank, task: Callable[[Halt], None]) -> None:
        self.engine.worker.request(Slot(self.number, rank), task)

    # -- in the worker -----------------------------------------------------------------------------------------

    def _work_of(self, view: View) -> Work:
        """What has been computed of this sweep already, if that was the last one."""
        views = [view, view.certified()] if view.compared else [view]
        made_from = [v.toml().partition("\n[figure]")[0] for v in views]
        work = self.work
        if work is None or made_from != self.made_from:
            work = self.work = None  # the old one is let go before the new one is made
            self.made_from = made_from
            work = self.work = Work([v.plan() for v in views], self.engine.threads)
        return work

    def _picture(self, view: View, seq: int, halt: Halt) -> None:
        for count, level in enumerate(self._work_of(view).levels(self.engine.pace, halt)):
            if count == 0 or level.complete or not self.unpainted:  # frames do not queue up where they are sent slowly
                self._draw(view, seq, level)
            if count == 0 and not level.complete:
                self.engine.worker.pause(halt, REST_SECONDS)
        latest = self.view  # a click since then has changed `at` alone
        if latest.at == latest.at and latest.mode != MAP:
            self._follow(halt, Rank.MOTION, partial(self._motion, latest, seq))
        else:
            self._follow(halt, Rank.EXACT, partial(self._exact, latest, None, []))

    def _draw(self, view: View, seq: int, level: Level) -> None:
        # of the latest view: it differs by `at`, or the page is not going to keep this address
        head: dict[str, Any] = {"seq": seq, "complete": level.complete, "address": self.view.address()}
        said = f"{100 * level.share:.0f} % of the sweep"
        if level.sketch is not None and not level.complete:
            s = level.sketch.results[0].settings
            said += f"; the rest a sketch of {s.transient} + {s.periods} periods"
        head["status"] = ("complete" if level.complete else said) + self._legend(view)
        left, right = _edges(view, SPAN, view.columns)
        if view.mode == MAP:
            low, high = _edges(view, Y_SPAN, view.rows)
            cells, palette, legend = painted(level, view.shade, view.limits)
            head["status"] += f"<br>{legend}"
            images = [cells]
        else:
            palette = INK
            low, high = view.bottom, view.top
            if low != low:
                low, high = fitting_range(level, view.quantity)
                head["fit"] = [low, high]
            images = pictures(level, view.quantity, low, high)
            if view.compared and view.compare == DIFFERENCE:
                images = [difference(*images)]
        place = {"palette": [palette], "x": [left], "dw": [right - left], "y": [low], "dh": [high - low]}
        self.unpainted += 1
        # the head first, as Bokeh compares what is new with what was: it differs
        self._later(partial(self._paint, [{"head": [json.dumps(head)], "image": [image], **place} for image in images]))

    @staticmethod
    def _legend(view: View) -> str:
        """What the colours of a diagram mean."""
        said = f" · above {view.method}, below certified" if view.compared else ""
        if view.compared and view.compare == DIFFERENCE:
            said = " · black: what both show, "
            said += f"<span style='color:#D55E00'>vermilion: what {view.method} alone shows</span>, "
            said += "<span style='color:#0072B2'>blue: what certified alone shows</span>"
        if view.orbits and view.mode != MAP:
            said += " · orbits of the undisturbed motion: blue stable, vermilion dashed unstable, circles bifurcations"
        return said

    def _paint(self, frames: list[dict[str, Any]]) -> None:
        self.unpainted = 0
        if len(frames) > 1:
            self.page.other.data = frames[1]
        self.page.frame.data = frames[0]

    def _motion(self, view: View, seq: int, halt: Halt) -> None:
        motion = motion_at(view, halt)
        said = words(motion, view)
        columns = lines(motion.trajectory)

        def show() -> None:
            self.page.motion.data = {**columns, "colour": CURVE_COLOURS}
            self._tell({"words": "<br>".join([*said, PENDING]), "address": view.address(), "done": seq})

        self._later(show)
        self._follow(halt, Rank.EXACT, partial(self._exact, view, motion, said))

    def _exact(self, view: View, motion: Motion | None, said: list[str], halt: Halt) -> None:
        """What is exact about a view and its motion, in the background."""
        self.engine.aside.start()  # before it is needed: the next click finds it warm
        call = partial(self.engine.aside.call, halt)
        if motion is not None:
            found = list(said)
            for line in exact_words(call, motion):
                found.append(line)
                self._later(partial(self._tell, {"words": "<br>".join(found)}))
        wanted = overlay_of(view)
        if wanted is None or wanted == self.overlay:
            return
        if view.mode == MAP:
            spans = {view.x: (view.low, view.high), view.y: (view.y_low, view.y_high)}
            curves = call(exact.plane_curves, spans["A"], spans["B"], view.orbits)
            self._later(partial(self._show_curves, view, curves))
        else:
            window = view.low, view.high, view.incline, view.orbits, view.quantity, view.section_phase
            self._later(partial(self._show_orbits, view, *call(exact.orbit_lines, *window)))

    def _clear(self) -> None:
        self.overlay = None
        self.page.stable.data = self.page.unstable.data = dict(NO_LINES)
        self.page.marks.data, self.page.curves.data = dict(NO_MARKS), dict(NO_CURVES)

    def _show_orbits(self, view: View, found: list[exact.Line], bifurcations: list[exact.Mark]) -> None:
        self.overlay = overlay_of(view)
        for source, stable in ((self.page.stable, True), (self.page.unstable, False)):
            curves = [(place(line.A, view.scale), column) for line in found if line.stable == stable
                      for column in line.values.T]  # fmt: skip
            source.data = {"x": [x for x, _ in curves], "y": [y for _, y in curves]}
        marks = [(m, y) for m in bifurcations for y in m.values.tolist()]
        self.page.marks.data = {
            "x": [float(place(m.A, view.scale)) for m, _ in marks],
            "y": [y for _, y in marks],
            "kind": [m.kind for m, _ in marks],
            "A": [repr(m.A) for m, _ in marks],
            "period": [m.period for m, _ in marks],
            "colour": [KIND_COLOURS[m.kind] for m, _ in marks],
        }

    def _show_curves(self, view: View, found: list[tuple[str, int, np.ndarray, np.ndarray]]) -> None:
        self.overlay = overlay_of(view)
        across = [(A, B) if view.x == "A" else (B, A) for _, _, A, B in found]
        self.page.curves.data = {
            "x": [place(x, view.scale) for x, _ in across],
            "y": [place(y, view.y_scale) for _, y in across],
            "kind": [kind for kind, *_ in found],
            "period": [period for _, period, *_ in found],
            "colour": [KIND_COLOURS[kind] for kind, *_ in found],
        }

    def _export(self, view: View, kind: str, halt: Halt) -> None:
        if kind == "toml":
            content = view.toml().encode()
        else:
            work = self._work_of(view)
            for _ in work.levels(self.engine.pace, halt):
                pass
            content = export.drawn(view, work.part.results[0], kind)
        file = {"name": f"view.{kind}", "base64": base64.b64encode(content).decode()}
        self._later(partial(self._tell, {"file": file}))

    def failed(self, rank: Rank, error: BaseException) -> None:
        """A task of this page broke off: say so, in one line."""
        self._later(partial(self._tell, {"refused": _one_line(error), "done": self.seq}))

    # -- what the page is told ---------------------------------------------------------------------------------

    def _later(self, change: Callable[[], None]) -> None:
        """Change the page from the thread of the server, if it is still open."""
        with suppress(RuntimeError, AttributeError):  # what Bokeh raises where the document has been taken apart
            self.document.add_next_tick_callback(change)

    def _tell(self, *items: Mapping[str, Any]) -> None:
        """Send this, and again what the page has not yet said to have heard: of two that arrive together, its scripts
        see the last only."""
        self.unheard += [{"number": next(self.numbers), **item} for item in items]
        self.page.news.data = {"items": [json.dumps(self.unheard)]}


Overlay = tuple[tuple[Any, ...], tuple[float, ...]]
"""Which exact curves lie over a view, and the window for which they were sought: those of an older one stay right."""


def overlay_of(view: View) -> Overlay | None:
    """What a view asks for; None: nothing, as there is nothing exact over other axes."""
    if not view.orbits:
        return None
    if view.mode != MAP:
        what = DIAGRAM, view.scale, view.incline, view.orbits, view.quantity, view.section_phase
        return (what, (view.low, view.high)) if view.x == "A" else None
    where = view.low, view.high, view.y_low, view.y_high
    return ((MAP, view.x, view.scale, view.y_scale, view.orbits), where) if {view.x, view.y} == {"A", "B"} else None


def exact_words(call: Callable[..., Any], motion: Motion) -> Any:
    """What is exact about a motion, a line at a time: its multiplier, and its limit."""
    known = motion.trajectory.arguments
    period = motion.summary["period"]
    if known["eps"] == 0.0 and period > 0:
        multiplier = call(exact.multiplier_at, known["A"], known["B"], period, motion.trajectory.impacts["phase"])
        if multiplier == multiplier:
            yield f"multiplier {multiplier:.10g}: {kind_of(multiplier)}"
    names = ("A", "B", "eta", "xi0", "dxi0", "tau0")
    k = call(exact.limit_at, {name: known[name] for name in names})
    if k["k2"] == k["k2"]:
        yield f"k₂ in ε: {k['k2']:.4g} (as a velocity {k['velocity']:.4g}): {html.escape(k['how'])}"
    else:
        yield f"k₂ in ε: {html.escape(k['how'])}"


def place(values: Any, scale: str) -> Any:
    """Where values of an axis are drawn."""
    return np.log10(values) if scale == LOG else values


def _edges(view: View, names: tuple[str, str, str], count: int) -> tuple[float, float]:
    """Where the outer cells of an axis end: its first and last value lie in their middles."""
    low, high, scale = (getattr(view, name) for name in names)
    first, last = float(place(low, scale)), float(place(high, scale))
    half = 0.5 * (last - first) / (count - 1)
    return first - half, last + half


def _one_line(error: BaseException) -> str:
    return html.escape(" ".join(str(error).split()) or type(error).__name__)


def read_address(address: str) -> View:
    """The view that an address describes. Raises ValueError with one sentence."""
    return View.read({key: value for key, value in parse_qsl(address.lstrip("?")) if key != "token"})


def _let_axes_follow_scene(known: dict[str, Any], changed: str) -> None:
    """Of axes and scene keep what was changed: B is no axis where it follows from a scene, which else has no axes."""
    if known.get(changed) in SCENE_AXES:
        known["scene"] = SI
    elif changed in ("x", "y") and known[changed] == "B":
        known["scene"] = DIMENSIONLESS
    strangers = ("B",) if known["scene"] == SI else SCENE_AXES
    for axis, other, keys in (("x", "y", (*SPAN, "at")), ("y", "x", Y_SPAN)):
        if known[axis] in strangers:
            usual = ("A", "B") if known["scene"] != SI else ("mu",) if known[other] == "A" else ("a0", "omega0")
            known[axis] = next(name for name in usual if name != known[other])
            for key in keys:
                known.pop(key, None)


def adapted(state: Mapping[str, Any], changed: str) -> View:
    """The view after one of its choices has changed: what stood on the old one makes room. Raises ValueError."""
    drop = {"x": (*SPAN, "at"), "y": Y_SPAN, "mode": ENDS, "quantity": ENDS, "shade": ENDS}
    known = {name: value for name, value in state.items() if name not in drop.get(changed, ())}
    _let_axes_follow_scene(known, changed)
    for scale, low, high in (("scale", "low", "high"), ("y_scale", "y_low", "y_high")):
        if changed == scale and known[scale] == LOG and float(known[low]) <= 0.0 < float(known[high]):
            known[low] = float(known[high]) / 1000.0
    return View.read(known)
