"""Long exact searches (orbits, bifurcations, limits) in a separate process, which is killed to cancel them.

These searches are Python loops that do not check the flag of a cancelled task (`Halt`). The process handles one call at
a time. After a kill a new process starts immediately and loads its modules while the page is drawn. A process that is
still loading or compiling is not killed. Otherwise each click would restart the compilation.
"""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection, Pipe
from time import sleep
from typing import Any

from vibrodrive.jit.slices import Halt, Halted

FROZEN = getattr(sys, "frozen", False)  # then `sys.executable` is not Python, but the program, which would start again

LOOK_SECONDS = 0.02  # interval between checks of `halt` while the other process computes


class SeparateProcess:
    """Separate process, started at the first call. Its first action is a call of `warm`."""

    def __init__(self, warm: Callable[[], object]) -> None:
        self._warm = warm
        self._process: subprocess.Popen[bytes] | None = None
        self._pipe: Connection | None = None
        self._warming = self._closed = False

    def call(self, halt: Halt, function: Callable[..., Any], *arguments: Any) -> Any:
        """Return the result of a function, which the process imports by name.

        If the function raises an exception, this exception is raised here. Raises Halted as soon as `halt` is set.
        """
        if FROZEN:
            raise RuntimeError("exact results need Python in a separate process, which a frozen program cannot start")
        self.start()
        if self._warming:
            self._answer(halt)
            self._warming = False
        self._send(function, arguments)
        try:
            good, value = self._answer(halt)
        except Halted:
            self._kill()
            self.start()
            raise
        if not good:
            raise value
        return value

    def _answer(self, halt: Halt) -> tuple[bool, Any]:
        """Wait for the answer to a call and return it: (True, result) or (False, exception). Raises Halted."""
        try:
            while self._pipe is not None and not halt.called:
                if self._pipe.poll(LOOK_SECONDS):
                    answer: tuple[bool, Any] = self._pipe.recv()
                    return answer
        except (EOFError, OSError):
            self._kill()
            if not halt.called and not self._closed:
                again = "the next request restarts it"
                raise RuntimeError(f"the process for exact results has ended unexpectedly; {again}") from None
        raise Halted

    def start(self) -> None:
        """Start the process, unless it is running, and call `warm` in it."""
        if self._process is not None and self._process.poll() is not None:
            self._kill()
        if self._process is None and not self._closed and not FROZEN:
            self._pipe, other = Pipe()
            self._process = subprocess.Popen(
                [sys.executable, "-c", f"from {__name__} import serve; serve({other.fileno()})"],
                stdin=subprocess.DEVNULL,
                stdout=2,  # print output of libraries to stderr
                pass_fds=[other.fileno()],
                env={**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)},
                start_new_session=True,  # so that Ctrl-C reaches the parent only
            )
            other.close()
            self._warming = True
            self._send(self._warm, ())

    def close(self) -> None:
        """End the process. No further process is started."""
        self._closed = True
        self._kill()

    def _kill(self) -> None:
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            process.wait()

    def _send(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
        if self._pipe is not None:
            with suppress(OSError):  # the process has ended; `_answer` reports this
                self._pipe.send((function, arguments))


def serve(file: int) -> None:
    """Main function of the separate process: answer calls from a pipe until the pipe closes or the parent ends.

    `file` is the file descriptor of the pipe.
    """
    os.nice(10)  # low priority, so that pictures are computed first
    threading.Thread(target=_end_with, args=(os.getppid(),), daemon=True).start()
    pipe = Connection(file)
    with suppress(EOFError, OSError):
        while True:
            function, arguments = pipe.recv()
            try:
                outcome = True, function(*arguments)
            except Exception as error:
                outcome = False, error
            pipe.send(outcome)


def _end_with(parent: int) -> None:
    while os.getppid() == parent:
        sleep(1.0)
    os._exit(0)
