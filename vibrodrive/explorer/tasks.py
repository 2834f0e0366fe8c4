"""Task of the worker for a page: its picture, its motion, and the limits of this motion.

It runs in the worker thread. Every message to the page is sent in the server thread (`Session.later`). `seq` is the
number of the page's message that requested the task.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from vibrodrive.explorer.controls import title_of
from vibrodrive.explorer.engine import KEPT, Engine
from vibrodrive.explorer.image import fitting_range, picture_of, pictures
from vibrodrive.explorer.motion import limit_at, limit_plans, shown_motion
from vibrodrive.explorer.server import build
from vibrodrive.explorer.session import Session, message_of
from vibrodrive.explorer.view import View
from vibrodrive.explorer.work import Level, Work
from vibrodrive.jit.slices import Halt
from vibrodrive.model import choices, size

SOON = 1.0  # seconds; a picture that takes longer waits for the limits
SAVED_POINTS, SAVED_BITS = 3500, 15  # most points of a curve in a saved page, and bits of their coordinates
LARGEST_PAGE = 2_000_000  # largest number of bytes of a saved page, which fits into a mail
REST_SECONDS = 0.12  # pause between the first picture and finer pictures; a moving mouse sends the next request earlier


def work_of(session: Session, view: View) -> Work:
    """Return the `Work` of the sweep of a view. If the `Work` of the session is for another sweep, create a new
    `Work`."""
    views = [view, replace(view, method="certified")] if view.compared else [view]
    made_from = [v.toml().partition("\n[figure]")[0] for v in views]
    work = session.work
    if work is None or made_from != session.made_from:
        session.work = None  # free the old arrays before new ones are allocated
        session.made_from = made_from
        plans = [v.plan() for v in views]
        session.engine.make_room(sum(map(size.result_bytes, plans)), f"periods = {view.recorded}")
        work = session.work = Work(plans, session.engine.threads)
    return work


def answer(session: Session, view: View, seq: int, asked: int, halt: Halt) -> None:
    """Show a view, whose picture was requested by the message `asked`, and its motion by `seq`.

    The motion comes after the first coarse picture, or before it if only the motion is new. The task can be halted at
    any time, and called again later.
    """
    if seq != asked or session.painted == asked:
        show_motion(session, view, seq, halt)
    if session.painted != asked:
        show_picture(session, view, seq, asked, halt)
    show_limits(session, view, halt)


def show_picture(session: Session, view: View, seq: int, asked: int, halt: Halt) -> None:
    """Draw the diagram or map of a view, first coarse, then with its motion, then finer. Before a slow rest come the
    limits of this motion."""
    for count, level in enumerate(work_of(session, view).levels(session.engine.pace, halt)):
        if count == 0 or level.complete or not session.unpainted:  # no finer picture while another is not yet sent
            head, arrays = titled_picture(view, level, session.pixels[1])
            session.unpainted += 1
            session.later(partial(_paint, session, head | {"seq": asked, "address": session.view.address()}, arrays))
        if count == 0 and seq == asked:
            show_motion(session, view, seq, halt)
        if count == 0 and not level.complete:
            session.engine.worker.pause(halt, REST_SECONDS)
        if level.left > SOON:
            show_limits(session, view, halt)
    session.painted = asked


def titled_picture(view: View, level: Level, height: int) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Return the picture of `picture_of` with its title, and how much of it is computed."""
    head, arrays = picture_of(view, level, height)
    title, conditions = title_of(view)
    head |= {"title": title, "conditions": conditions, "complete": level.complete, "done": level.share}
    return head | {"left": level.left, "count": level.sweep.done.size}, arrays


def _paint(session: Session, head: dict[str, Any], arrays: dict[str, np.ndarray]) -> None:
    session.unpainted = 0
    session.send("picture", head, arrays)


def show_motion(session: Session, view: View, seq: int, halt: Halt) -> None:
    """Show the motion of a view, unless the page already shows it."""
    plan, done = view.motion_plan(), {"done": seq, "address": session.view.address()}
    moving = f"{plan} {view.mode} {view.quantity}"
    if moving == session.moving:
        session.later(partial(session.news, done))
        return
    head, arrays = shown_motion(view, session.engine.limits, halt)
    session.later(partial(session.send, "motion", head | done, arrays))
    session.moving, session.rests = moving, head["status"] == choices.Status.NEVER_LEAVES.name


def show_limits(session: Session, view: View, halt: Halt) -> None:
    """Find the limits k₂ of the motion of a view that are not yet known, and send them one by one."""
    known, plans = session.engine.limits, {} if session.rests else limit_plans(view.motion_plan())
    for name, of in plans.items():
        if (key := str(of)) not in known:
            if len(known) == KEPT:
                del known[next(iter(known))]  # the oldest entry
            known[key] = limit_at(of, halt)
            session.later(partial(session.news, {"limits": {name: known[key]}}))


def save(session: Session, view: View, made: dict[str, Any], halt: Halt) -> None:
    """Send the page of a view as one file that needs no server, with its picture, and motions along its axes. What is
    ready stays in `made`, if the task is halted."""
    sized = view.sized(*session.pixels)
    if "work" not in made:
        made |= {"work": work_of(session, sized), "motions": []}
    *_, level = made["work"].levels(session.engine.pace, halt)
    places, motions = view.stored, made["motions"]
    for at, at_y in places[len(motions) :]:
        head, arrays = shown_motion(replace(sized, at=at, at_y=at_y), session.engine.limits, halt, SAVED_POINTS)
        motions.append(message_of("motion", head, {name: lean(array) for name, array in arrays.items()}))
    picture = message_of("picture", *titled_picture(sized, level, session.pixels[1]))
    while len((page := build(view, "", [picture, *motions], places)).encode()) > LARGEST_PAGE:
        places, motions = places[::2], motions[::2]
    session.later(partial(session.news, {"saved": page}))


def lean(array: np.ndarray) -> np.ndarray:
    """Return an array with as many bits as a picture needs, so that it becomes small when it is compressed."""
    largest = np.nanmax(np.abs(array), initial=1e-30)
    step = 2.0 ** (np.ceil(np.log2(largest)) - SAVED_BITS)
    return (np.rint(array / step) * step).astype(array.dtype) if array.dtype.kind == "f" else array


def warm_picture(engine: Engine, halt: Halt) -> None:
    """Run a small sweep to load all modules and kernels that the first picture needs."""
    view = View.read({"columns": 200})
    for level in Work([view.plan()], engine.threads).levels(engine.pace, halt):
        pictures(level, view.quantity, *fitting_range(level, view.quantity))
