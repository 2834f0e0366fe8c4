"""Task of the worker for a page: its picture, its motion, and the limits of this motion.

It runs in the worker thread. Every message to the page is sent in the server thread (`Session.later`).
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from vibrodrive.explorer.controls import build
from vibrodrive.explorer.engine import KEPT
from vibrodrive.explorer.image import picture_of
from vibrodrive.explorer.motion import limit_at, limit_plans, shown_motion
from vibrodrive.explorer.session import Session, message_of, stored
from vibrodrive.explorer.view import View, inside
from vibrodrive.explorer.work import Work
from vibrodrive.jit.slices import Halt
from vibrodrive.model import choices, size

SOON = 1.0  # seconds; a picture that takes longer waits for the limits
SAVED_MOTIONS = 31  # number of motions of a saved page, beside the one that the page shows
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


def answer(session: Session, view: View, about: dict[str, Any], halt: Halt) -> None:
    """Show a view, whose picture was requested by the message `seq` of `about`, and its motion by the message `done`.

    The motion comes after the first coarse picture, or before it if only the motion is new. The task can be halted at
    any time, and called again later.
    """
    if about["done"] != about["seq"] or session.painted == about["seq"]:
        show_motion(session, view, about, halt)
    if session.painted != about["seq"]:
        show_picture(session, view, about, halt)
    show_limits(session, view, halt)


def show_picture(session: Session, view: View, about: dict[str, Any], halt: Halt) -> None:
    """Draw the diagram or map of a view, first coarse, then with its motion, then finer. Before a slow rest come the
    limits of this motion."""
    for count, level in enumerate(work_of(session, view).levels(session.engine.pace, halt)):
        head, arrays = picture_of(view, level, session.pixels[1])
        session.later(partial(session.send, "picture", head | about, arrays))
        if count == 0:
            show_motion(session, view, about, halt)
        if count == 0 and not level.complete:
            session.engine.worker.pause(halt, REST_SECONDS)
        if level.left > SOON:
            show_limits(session, view, halt)
    session.painted = about["seq"]


def show_motion(session: Session, view: View, about: dict[str, Any], halt: Halt) -> None:
    """Show the motion of a view, unless the page already shows it."""
    moving = f"{view.motion_plan()} {view.mode} {view.quantity}"
    if moving == session.moving:
        session.later(partial(session.news, about))
        return
    head, arrays = shown_motion(view, session.engine.limits, halt)
    session.later(partial(session.send, "motion", head | about, arrays))
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


def save(session: Session, view: View, halt: Halt) -> None:
    """Send the page of a view as one file that needs no server, with its picture as far as it is computed, and motions
    along its axis."""
    sized, shares = view.sized(*session.pixels), np.linspace(0.0, 1.0, SAVED_MOTIONS).tolist()
    places = [*dict.fromkeys([view.at, *(inside(view.low, view.high, view.scale, share) for share in shares)])]
    level = next(work_of(session, sized).levels(session.engine.pace, halt))
    head, arrays = picture_of(sized, level._replace(left=0.0), session.pixels[1])
    picture, motions = stored(message_of("picture", head, arrays)), []
    for at in places:
        head, arrays = shown_motion(replace(sized, at=at), session.engine.limits, halt, SAVED_POINTS)
        motions.append(stored(message_of("motion", head, {name: lean(array) for name, array in arrays.items()})))
    while len((page := build(view, messages=[picture, *motions], places=places)).encode()) > LARGEST_PAGE:
        places, motions = places[::2], motions[::2]
    session.later(partial(session.news, {"saved": page}))


def lean(array: np.ndarray) -> np.ndarray:
    """Return an array with as many bits as a picture needs, so that it becomes small when it is compressed."""
    largest = np.nanmax(np.abs(array), initial=1e-30)
    step = 2.0 ** (np.ceil(np.log2(largest)) - SAVED_BITS)
    return (np.rint(array / step) * step).astype(array.dtype) if array.dtype.kind == "f" else array
