"""Progress of a sweep in one line. A terminal rewrites the line; otherwise a new line is printed periodically.

The progress bar of click (8.5, tested) prints nothing without a terminal, ends the computation if the terminal is
closed, and counts the points of an earlier run as fresh ones.
"""

from __future__ import annotations

import contextlib
import shutil
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TextIO

if TYPE_CHECKING:
    from vibrodrive.batch.block import Block
    from vibrodrive.jit.compilation import Compilation
    from vibrodrive.model.plan import Plan

PLAIN_SECONDS = 10.0  # seconds between lines if stderr is not a terminal (a log, a batch system)

COMPILING = "compiling the kernels, once for this version, Python and processor, usually in 10 to 30 s"
"""Message at the start of a compilation."""


@dataclass
class Tally:
    """Progress of a sweep. One thread counts, another displays it."""

    points: int = 0  # points of the sweep
    done: int = 0  # points computed in this run and in earlier runs
    fresh: int = 0  # points computed in this run
    periods: int = 0  # excitation periods of one point, including the transient; 0 if it has several motions
    stage: str = ""  # activity before the first and after the last point; "" while points are computed
    elsewhere: str = ""  # possible activity of workers before the first point arrives
    waiting: str = ""  # reason why a cluster waits
    began: float = field(default_factory=time.monotonic)  # start of the computation
    raised: list[str] = field(default_factory=list)  # for each point at which a function raised, a text with both

    def start(self, plan: Plan, done: int = 0) -> None:
        """Set the numbers of points and periods, and start the measurement of time."""
        several = any(record.alone for record in plan.record)
        self.periods = 0 if several else plan.settings.transient + plan.settings.periods
        self.points, self.done, self.stage, self.began = plan.n_points, done, "", time.monotonic()

    def add(self, block: Block) -> None:
        """Count a block that is finished."""
        points = block.stop - block.start
        self.done += points
        self.fresh += points
        self.raised += block.raised

    @property
    def rate(self) -> float:
        """Points per second in this run."""
        return self.fresh / max(time.monotonic() - self.began, 1e-9)

    def line(self) -> str:
        """Return the text with the computed share, the rate and the remaining time."""
        if self.stage:
            return self.stage
        share = f"{100 * self.done / max(self.points, 1):5.1f} %"
        if self.waiting:
            return f"{share}  {self.waiting}"
        if not self.fresh:
            return f"{share}  {self.elsewhere}: {time.monotonic() - self.began:.0f} s" if self.elsewhere else share
        left = duration((self.points - self.done) / self.rate)
        return f"{share}  {self.speed('  ')}  {left} left"

    def speed(self, between: str) -> str:
        """Return the text with the points and, if each point has one motion, the periods per second."""
        points = f"{self.rate:.3g} points/s"
        return f"{self.rate * self.periods:.2e} periods/s{between}{points}" if self.periods else points


def duration(seconds: float) -> str:
    """Write seconds as 4.1 ms, 0.32 s, 3.2 s, 4 min 10 s, 2 h 5 min or 3 d 4 h."""
    if seconds < 0.0995:
        return f"{1000 * seconds:.2g} ms"
    if seconds < 0.995:
        return f"{seconds:.2f} s"
    if seconds < 59.95:
        return f"{seconds:.1f} s"
    minutes, s = divmod(round(seconds), 60)
    if minutes < 60:
        return f"{minutes} min {s} s"
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min" if hours < 24 else f"{hours // 24} d {hours % 24} h"


class Show:
    """A progress line on a stream. Errors of the stream, such as a closed terminal, are ignored."""

    def __init__(self, stream: TextIO, name: str) -> None:
        self._stream = stream
        self._name = name
        self._terminal = stream.isatty()
        self._last = time.monotonic()
        self._drawn = False
        self._announced = False

    def compiling(self, progress: str) -> None:
        """Print COMPILING once, and show the progress of the compilation."""
        if not self._announced:
            self._announced = True
            self.say(COMPILING)
        self.update(lambda: f"compiling: {progress}")

    def look(self, line: Callable[[], str], compilation: Compilation | None) -> None:
        """Show `line()`, or the time of a running compilation. `compilation` is None until Numba is loaded."""
        if compilation is not None and compilation.running:
            self.compiling(compilation.progress)
        else:
            self.update(line)

    def update(self, line: Callable[[], str]) -> None:
        """Show `line()`. Without a terminal this prints at most one line in PLAIN_SECONDS."""
        if self._terminal:
            width = shutil.get_terminal_size().columns - 1
            self._write(f"\r\x1b[K{self._name}  {line()}"[: width + 4])
            self._drawn = True
        elif time.monotonic() - self._last >= PLAIN_SECONDS:
            self._last = time.monotonic()
            self._write(f"{self._name}  {line()}\n")

    def say(self, message: str) -> None:
        """Print a line that is not overwritten."""
        self.clear()
        self._write(f"{message}\n")

    def clear(self) -> None:
        """Erase the rewritten line."""
        if self._drawn:
            self._write("\r\x1b[K")
            self._drawn = False

    def _write(self, text: str) -> None:
        with contextlib.suppress(OSError, ValueError):
            self._stream.write(text)
            self._stream.flush()


class NotebookShow(Show):
    """Progress lines below the running cell of a notebook. The last line is replaced when the progress changes."""

    def __init__(self, display: Callable[..., Any], name: str) -> None:
        super().__init__(sys.stderr, name)
        self._display = display
        self._lines: list[str] = []
        self._handle: Any = None

    def update(self, line: Callable[[], str]) -> None:
        self._put([*self._lines, f"{self._name}  {line()}"])
        self._drawn = True

    def say(self, message: str) -> None:
        self._lines.append(message)
        self._put(self._lines)

    def clear(self) -> None:
        if self._drawn:
            self._put(self._lines)
            self._drawn = False

    def _put(self, lines: list[str]) -> None:
        content = {"text/plain": "\n".join(lines)}
        if self._handle is None:
            self._handle = self._display(content, raw=True, display_id=True)
        else:
            self._handle.update(content, raw=True)


def make_display(name: str) -> Show | None:
    """Return a Show on a terminal or in a notebook; None elsewhere, and while another Show is active."""
    ipython = sys.modules.get("IPython")
    notebook = ipython is not None and hasattr(ipython.get_ipython(), "kernel")
    if not notebook and (sys.stderr is None or not sys.stderr.isatty()):
        return None
    if any(thread.name == WATCHER for thread in threading.enumerate()):
        return None
    if notebook:
        from IPython.display import display

        return NotebookShow(display, name)
    return Show(sys.stderr, name)


WATCH_SECONDS = 0.2

WATCHER = "watch"  # name of the thread that shows progress; at most one exists
SHOWN_AFTER = 1.0  # seconds after which the progress of a call in Python is shown; most calls are shorter


@contextlib.contextmanager
def watching(look: Callable[[], None], after: float = 0.0) -> Iterator[None]:
    """Call `look` every WATCH_SECONDS, from `after` seconds on, in a separate thread while the block runs."""
    ended = threading.Event()

    def watch() -> None:
        wait = after
        while not ended.wait(wait):
            look()
            wait = WATCH_SECONDS

    watcher = threading.Thread(target=watch, name=WATCHER, daemon=True)
    with contextlib.suppress(RuntimeError):  # no further thread can be started
        watcher.start()
    try:
        yield
    finally:
        ended.set()
        if watcher.ident:
            watcher.join()


@contextlib.contextmanager
def shown(show: Show | None, look: Callable[[Show], None], after: float | None = None) -> Iterator[None]:
    """Call `look` with a Show periodically while the block runs, from `after` seconds (default SHOWN_AFTER) on.

    The progress line is cleared at the end.
    """
    if show is None:
        yield
        return
    try:
        with watching(lambda: look(show), SHOWN_AFTER if after is None else after):
            yield
    finally:
        show.clear()


@contextlib.contextmanager
def under_way(name: str, show: Show | None = None) -> Iterator[None]:
    """While the block runs, show its elapsed time or a compilation, with `show` at once."""
    from vibrodrive.jit.compilation import compilation

    began = time.monotonic()

    def line() -> str:
        return f"under way: {duration(time.monotonic() - began)}"

    with shown(show or make_display(name), lambda show: show.look(line, compilation), 0.0 if show else None):
        yield
