"""Long exact work (orbits, bifurcations, limits) in a process of its own, which is killed where its result has become
useless.

These searches are loops in Python without a flag to look at. The process answers one call at a time and stays for the
next one. After a kill another process starts at once and loads what it needs while the page is drawn. A process that
is still loading, or compiling, is not killed: otherwise each click would begin the compilation again.
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

LOOK_SECONDS = 0.02  # between looks at the flag while the other process computes

Answer = tuple[bool, Any]
"""True and the result of a call, or False and its exception."""


class Aside:
    """The other process, started when it is first needed. It begins with a call of `warm`."""

    def __init__(self, warm: Callable[[], object]) -> None:
        self._warm = warm
        self._process: subprocess.Popen[bytes] | None = None
        self._answers: queue.SimpleQueue[Answer | None] = queue.SimpleQueue()
        self._warming = self._closed = False

    def call(self, halt: Halt, function: Callable[..., Any], *arguments: Any) -> Any:
        """Return the result of a function, found by its name; raise its exception, or Halted once the flag is set."""
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
                raise RuntimeError("the process for exact work has ended")
        raise Halted

    def start(self) -> None:
        """Start the process, if it does not run, and let it warm up."""
        if self._process is not None and self._process.poll() is not None:
            self._kill()
        if self._process is None and not self._closed:
            self._process = subprocess.Popen(
                [sys.executable, "-c", f"from {__name__} import serve; serve()"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                env={**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)},
                start_new_session=True,  # Ctrl-C on the terminal is for the parent
            )
            self._answers = queue.SimpleQueue()
            threading.Thread(target=_receive, args=(self._process.stdout, self._answers), daemon=True).start()
            self._warming = True
            self._send(self._warm, ())

    def close(self) -> None:
        """End the process; none is started from now on."""
        self._closed = True
        self._kill()

    def _kill(self) -> None:
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            process.wait()
            with suppress(OSError):  # of what was still to be written
                process.stdin.close()  # type: ignore[union-attr]

    def _send(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
        process = self._process
        if process is not None and process.stdin is not None:
            with suppress(OSError, ValueError):  # it has ended: `call` hears of it from `_receive`
                pickle.dump((function, arguments), process.stdin)
                process.stdin.flush()


def _receive(stream: BinaryIO, answers: queue.SimpleQueue[Answer | None]) -> None:
    """Hand on the answers of the process, and None when it has ended."""
    with stream, suppress(EOFError, OSError, pickle.UnpicklingError):
        while True:
            answers.put(pickle.load(stream))
    answers.put(None)


def serve() -> None:
    """The other process: answers the calls on its standard input until that is closed, or until its parent ends."""
    threading.Thread(target=_end_with, args=(os.getppid(),), daemon=True).start()
    calls, answers = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a library prints is no answer
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
