"""Long exact searches (orbits, bifurcations, limits) in a separate process, which is killed to cancel them.

These searches are Python loops that do not check a flag. The process handles one call at a time and then waits for the
next one. After a kill a new process starts immediately and loads its modules while the page is drawn. A process that is
still loading or compiling is not killed: otherwise each click would restart the compilation.
"""

from __future__ import annotations

import os
import pickle
import queue
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from time import sleep
from typing import Any, BinaryIO

from vibrodrive.jit.slices import Halt, Halted

LOOK_SECONDS = 0.02  # interval between checks of the flag while the other process computes

Answer = tuple[bool, Any]
"""(True, result of a call) or (False, its exception)."""


class Aside:
    """Separate process, started at the first call. It first calls `warm`."""

    def __init__(self, warm: Callable[[], object]) -> None:
        self._warm = warm
        self._process: subprocess.Popen[bytes] | None = None
        self._answers: queue.SimpleQueue[Answer | None] = queue.SimpleQueue()
        self._warming = self._closed = False

    def call(self, halt: Halt, function: Callable[..., Any], *arguments: Any) -> Any:
        """Return the result of a function, which the process imports by name.

        Raises the exception of the function, or Halted once the flag is set.
        """
        self.start()
        if self._warming:
            self._next_answer(halt)
            self._warming = False
        self._send(function, arguments)
        try:
            good, value = self._next_answer(halt)
        except Halted:
            self._kill()
            self.start()
            raise
        if not good:
            raise value
        return value

    def _next_answer(self, halt: Halt) -> Answer:
        while not halt.called:
            try:
                answer = self._answers.get(timeout=LOOK_SECONDS)
            except queue.Empty:
                continue
            if answer is not None:
                return answer
            self._kill()
            if not halt.called and not self._closed:
                raise RuntimeError("the process for exact results has ended unexpectedly; the next request restarts it")
        raise Halted

    def start(self) -> None:
        """Start the process, unless it is running, and call `warm` in it."""
        if self._process is not None and self._process.poll() is not None:
            self._kill()
        if self._process is None and not self._closed:
            self._process = subprocess.Popen(
                [sys.executable, "-c", f"from {__name__} import serve; serve()"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                env={**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)},
                start_new_session=True,  # so that Ctrl-C reaches the parent only
            )
            self._answers = queue.SimpleQueue()
            threading.Thread(target=_receive, args=(self._process.stdout, self._answers), daemon=True).start()
            self._warming = True
            self._send(self._warm, ())

    def close(self) -> None:
        """End the process. No other one is started."""
        self._closed = True
        self._kill()

    def _kill(self) -> None:
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            process.wait()
            with suppress(OSError):  # from data still in the buffer
                process.stdin.close()  # type: ignore[union-attr]

    def _send(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
        process = self._process
        if process is not None and process.stdin is not None:
            with suppress(OSError, ValueError):  # the process has ended; `call` gets None from `_receive`
                pickle.dump((function, arguments), process.stdin)
                process.stdin.flush()


def _receive(stream: BinaryIO, answers: queue.SimpleQueue[Answer | None]) -> None:
    """Put the answers of the process into the queue, and None when it has ended."""
    with stream, suppress(EOFError, OSError, pickle.UnpicklingError):
        while True:
            answers.put(pickle.load(stream))
    answers.put(None)


def serve() -> None:
    """Main function of the separate process: answer calls from standard input until it closes or the parent ends."""
    threading.Thread(target=_end_with, args=(os.getppid(),), daemon=True).start()
    calls, answers = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # redirect the prints of libraries to stderr
    with suppress(EOFError):
        while True:
            try:
                function, arguments = pickle.load(calls)
                outcome: Answer = True, function(*arguments)
            except EOFError:
                raise
            except Exception as error:
                outcome = False, error
            pickle.dump(outcome, answers)
            answers.flush()


def _end_with(parent: int) -> None:
    while os.getppid() == parent:
        sleep(1.0)
    os._exit(0)
