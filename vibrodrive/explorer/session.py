"""Session of one open page. It passes the requests of the page to the worker, and sends messages to the page."""

from __future__ import annotations

import html
import itertools
import json
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qsl

from bokeh.document import Document
from bokeh.document.events import MessageSentEvent

from vibrodrive.explorer.engine import Engine
from vibrodrive.explorer.layout import NO_CURVES, NO_MOTION, build, key_of_lines
from vibrodrive.explorer.view import COLUMNS, ENDS, MOST_COLUMNS, PICTURE_ROWS, SI, SPAN, UNITLESS, Y_SPAN, View
from vibrodrive.explorer.worker import Rank, Slot, Task
from vibrodrive.jit.slices import Halt
from vibrodrive.model.drawing import MAP
from vibrodrive.model.names import LOG, SCENE_AXES

if TYPE_CHECKING:
    from vibrodrive.explorer.work import Work

NUMBERS = itertools.count()


class Session:
    """Session of a page, from opening to closing.

    "Reset" restores the view `base`. `address` is the query part of the address of the page, without the token.
    """

    def __init__(self, document: Document, engine: Engine, base: View, address: str, token: str) -> None:
        self.document, self.engine, self.base = document, engine, base
        self.number = next(NUMBERS)
        self.work: Work | None = None
        self.made_from: list[str] = []
        self.view, self.seq = base, 0
        self.pixels = COLUMNS, PICTURE_ROWS  # width and height of the picture in the page
        self.refused = ""
        self.unpainted = 0
        self.overlay: Overlay | None = None
        if address:
            try:
                self.view = read_address(address)
            except ValueError as error:
                self.refused = _one_line(error)
        self.page = build(document, self.view, token)
        document.on_message("asked", self._receive)
        engine.pages[self.number] = self
        document.on_session_destroyed(lambda context: self._closed())

    def _closed(self) -> None:
        self._cancel_work()
        self.engine.pages.pop(self.number, None)

    def _cancel_work(self) -> None:
        """Cancel the work of a page that the user has left. Its session may stay open, because browsers keep pages for
        "back"."""
        self.engine.worker.cancel(self.number)
        self.work = None

    def _receive(self, message: str) -> None:
        asked = json.loads(message)
        self.seq = asked["seq"]
        if asked.get("pixels"):
            width, height = (min(MOST_COLUMNS, max(2, int(length))) for length in asked["pixels"])
            self.pixels = width, height
        try:
            self._answer(asked)
        except Exception as error:  # report every error, so that the page can send the next request
            self.notify({"refused": _one_line(error), "done": self.seq})

    def _answer(self, asked: Mapping[str, Any]) -> None:
        if asked.get("hello"):
            self.notify({"apply": self.view.state(), "refused": self.refused})
        elif asked.get("ping"):
            self.notify({})
        elif asked.get("left"):
            self._cancel_work()
        elif asked.get("reset"):
            self.notify({"apply": self.base.state()})
        elif "address" in asked:
            self.notify({"apply": read_address(asked["address"]).state()})
        elif "changed" in asked:
            self.notify({"apply": adapted(asked["view"], asked["changed"]).state()})
        elif "dive" in asked:
            view = View.read(asked["view"])
            there = {view.y: asked["dive"], "mode": "diagram", "bottom": None, "top": None}
            self.notify({"apply": View.read(asked["view"] | there).state()})
        elif "file" in asked:
            self.request(Rank.EXPORT, self.sized(View.read(asked["view"])), asked["file"])
        else:
            self._show(View.read(asked["view"]), asked.get("only_motion", False))

    def _show(self, view: View, only_motion: bool) -> None:
        """Request the picture of a view or, if `only_motion`, only the curves of its motion."""
        self.view, seq = view, self.seq
        wanted = overlay_of(view)
        if self.overlay and (wanted is None or wanted[0] != self.overlay[0]):
            self.overlay = None
            self.page.lines.data, self.page.marks.data = dict(NO_CURVES), dict(NO_CURVES)
        if self.page.motion.data["time"] and not view.follows:
            self.page.motion.data = dict(NO_MOTION)
            self.notify({"words": ""})
        if only_motion:
            self.request(Rank.MOTION, self.sized(view), seq, instead_of=(Rank.EXACT,))
        else:
            self.request(Rank.PICTURE, self.sized(view), seq, instead_of=(Rank.EXACT, Rank.MOTION))

    def sized(self, view: View) -> View:
        """Return the view with numbers of columns and rows that suit the frame of the page."""
        return view.sized(*self.pixels)

    def request(self, rank: Rank, *arguments: Any, instead_of: tuple[Rank, ...] = ()) -> None:
        """Request the task of this rank with these arguments, and cancel the tasks of the ranks in `instead_of`."""
        self.engine.worker.request(Slot(self.number, rank), self._task(rank, arguments), instead_of)

    def follow(self, halt: Halt, rank: Rank, *arguments: Any) -> None:
        """Request a task that runs after the running task, which calls this function."""
        self.engine.worker.follow(halt, Slot(self.number, rank), self._task(rank, arguments))

    def _task(self, rank: Rank, arguments: tuple[Any, ...]) -> Task:
        return lambda halt: self.engine.tasks().TASKS[rank](self, *arguments, halt)

    def failed(self, rank: Rank, error: BaseException) -> None:
        """Show the error of a task of this page, in one line."""
        self.later(partial(self.notify, {"refused": _one_line(error), "done": self.seq}))
        if rank != Rank.EXPORT:  # the exact curves are not computed, because the failed task would have requested them
            self.later(self.show_key)

    def later(self, change: Callable[[], None]) -> None:
        """Call `change` in the thread of the server, if the page is still open."""
        with suppress(RuntimeError, AttributeError):  # raised by Bokeh if the document has been destroyed
            self.document.add_next_tick_callback(change)

    def notify(self, news: Mapping[str, Any]) -> None:
        """Send these values to the scripts of the page."""
        self.send("news", json.dumps(news))

    def send(self, kind: str, content: object) -> None:
        """Send a message of a kind for which browser.js has a function."""
        self.document.callbacks.trigger_on_change(MessageSentEvent(self.document, kind, content))

    def belongs(self, overlay: Overlay | None) -> bool:
        """Return True if the exact curves with the key of `overlay` belong to the latest view. Windows may differ."""
        wanted = overlay_of(self.view)
        return overlay is not None and wanted is not None and wanted[0] == overlay[0]

    def show_key(self) -> None:
        """Show the key to the exact curves in place of the note that they are being computed."""
        self.notify({"note": self.key_of_overlay()})

    def key_of_overlay(self) -> str:
        """Return the key to the exact curves and bifurcations of the page, as HTML."""
        lines, marks = (dict.fromkeys(zip(source.data["colour"], source.data["kind"], strict=True))
                        for source in (self.page.lines, self.page.marks))  # fmt: skip
        return f"{key_of_lines(lines)} {key_of_lines(marks, '○')}".strip()


Overlay = tuple[tuple[Any, ...], tuple[float, ...]]
"""Key of the exact curves of a view, and the window (the ends of the axes) in which the curves were computed.

If only the window changes, the older curves remain valid.
"""


def overlay_of(view: View) -> Overlay | None:
    """Return key and window of the exact curves of a view. Return None if none are wanted, or none exist for its
    axes."""
    if not view.orbits or view.mode == MAP or view.x != "A":
        return None
    unit = view.measure(view.quantity).of(1.0)
    of = view.scale, view.incline, view.orbits, view.quantity, view.section_phase, unit
    return of, (view.low, view.high)


def _one_line(error: BaseException) -> str:
    return html.escape(" ".join(str(error).split()) or type(error).__name__)


def read_address(address: str) -> View:
    """Return the view of an address. Raises ValueError with a message of one line."""
    return View.read({key: value for key, value in parse_qsl(address.lstrip("?")) if key != "token"})


OF_ABSCISSA, OF_ORDINATE = (*SPAN, "at", *ENDS), Y_SPAN  # fields that return to their defaults if an axis changes


def _let_axes_follow_scene(known: dict[str, Any], changed: str) -> None:
    """Adapt the field `scene` (SI units or dimensionless) to a changed axis, or the axes to a changed `scene`.

    With SI units B cannot be an axis. Without SI units the quantities of a machine cannot be axes.
    """
    if known.get(changed) in SCENE_AXES:
        known["scene"] = SI
    elif changed in ("x", "y") and known[changed] == "B":
        known["scene"] = UNITLESS
    strangers = ("B",) if known["scene"] == SI else SCENE_AXES
    for axis, other, keys in (("x", "y", OF_ABSCISSA), ("y", "x", OF_ORDINATE)):
        if known[axis] in strangers:
            usual = ("A", "B") if known["scene"] != SI else ("mu",) if known[other] == "A" else ("a0", "omega0")
            known[axis] = next(name for name in usual if name != known[other])
            for key in keys:
                known.pop(key, None)


def adapted(state: Mapping[str, Any], changed: str) -> View:
    """Return the view after a change of the field `changed`, with defaults for all fields that depend on this field.
    Raises ValueError."""
    drop = {"x": OF_ABSCISSA, "y": OF_ORDINATE, "mode": ENDS, "quantity": ENDS, "shade": ENDS, "scene": ENDS}
    known = {name: value for name, value in state.items() if name not in drop.get(changed, ())}
    _let_axes_follow_scene(known, changed)
    for scale, low, high in (("scale", "low", "high"), ("y_scale", "y_low", "y_high")):
        if changed == scale and known[scale] == LOG and float(known[low]) <= 0.0 < float(known[high]):
            known[low] = float(known[high]) / 1000.0
    return View.read(known)
