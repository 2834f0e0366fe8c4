"""Long exact work (orbits, bifurcations, limits) in a process of its own, which is told to give it up at any point.

These searches are loops in Python without a flag to look at. But Ctrl-C ends them at once, wherever they are: so they
run in a process whose only business they are, and there a search that nobody waits for any more is ended as by Ctrl-C.
The process stays for the next one. What it loads or compiles when it starts is never given up: otherwise each click
would begin the compilation anew.
"""

from __future__ import annotations

import itertools
import math
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Any, BinaryIO

from vibrodrive.jit.slices import Halt, Halted

LOOK_SECONDS = 0.02
"""How often the flag is looked at while the other process computes."""

AGAIN_SECONDS = 0.1
"""How long after an interrupt the next one comes: one that falls into a finalizer is lost there."""


class Aside:
    """The other process, started when it is first needed. It begins with `warm`, which is not given up."""

    def __init__(self, warm: Callable[[], object]) -> None:
        self._warm = warm
        self._process: subprocess.Popen[bytes] | None = None
        self._answers: queue.SimpleQueue[tuple[float, bool, Any] | None] = queue.SimpleQueue()
        self._numbers = itertools.count(1)

    def call(self, halt: Halt, function: Callable[..., Any], *arguments: Any) -> Any:
        """What the function, found by its name in the other process, returns for these arguments.

        Raises
        ------
        Halted
            if the flag is set meanwhile; then the search ends, too.
        Exception
            that of the function.
        """
        self.start()
        number = next(self._numbers)
        self._send(number, function, arguments)
        while True:
            if halt.called:
                self._send(number, None, ())
                raise Halted
            try:
                answer = self._answers.get(timeout=LOOK_SECONDS)
            except queue.Empty:
                continue
            if answer is None:
                self.close()
                if halt.called:  # it has been closed for that
                    raise Halted
                raise RuntimeError("the process for exact work has ended")
            of, good, value = answer
            if of == number:  # not of one that was given up a moment too late
                if not good:
                    raise value
                return value

    def start(self) -> None:
        """Start the process, if it does not run, and let it warm up."""
        if self._process is not None and self._process.poll() is not None:
            self.close()
        if self._process is None:
            self._process = subprocess.Popen(
                [sys.executable, "-c", f"from {__name__} import serve; serve()"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                env={**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)},
                start_new_session=True,  # Ctrl-C on the terminal is for the parent
            )
            self._answers = queue.SimpleQueue()
            threading.Thread(target=_receive, args=(self._process.stdout, self._answers), daemon=True).start()
            self._send(math.inf, self._warm, ())

    def close(self) -> None:
        """End the process."""
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            process.wait()
            with suppress(OSError):  # of what was still to be written
                process.stdin.close()  # type: ignore[union-attr]

    def _send(self, number: float, function: Callable[..., Any] | None, arguments: tuple[Any, ...]) -> None:
        """Ask for a call, or with None that the call of this number be given up."""
        process = self._process
        if process is not None and process.stdin is not None:
            with suppress(OSError, ValueError):  # it has ended: `call` hears of it from `_receive`
                pickle.dump((number, None if function is None else pickle.dumps((function, arguments))), process.stdin)
                process.stdin.flush()


def _receive(stream: BinaryIO, answers: queue.SimpleQueue[tuple[float, bool, Any] | None]) -> None:
    """Hand on what the process says, and None when it has ended."""
    with stream, suppress(EOFError, OSError, pickle.UnpicklingError):
        while True:
            answers.put(pickle.load(stream))
    answers.put(None)


def serve() -> None:
    """The other process: answers what is written to its standard input until that is closed."""
    requests, answers = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a library prints is no answer
    inbox: queue.SimpleQueue[tuple[float, bytes]] = queue.SimpleQueue()
    current, given_up = math.inf, 0.0  # numbers: of the call under way, and of the last one that was given up

    def interrupt(signum: int, frame: object) -> None:
        if current <= given_up:
            raise KeyboardInterrupt
        signal.setitimer(signal.ITIMER_REAL, 0)

    def read() -> None:
        nonlocal given_up
        with suppress(EOFError):
            while True:
                number, call = pickle.load(requests)
                if call is not None:
                    inbox.put((number, call))
                else:
                    given_up = number
                    signal.setitimer(signal.ITIMER_REAL, 1e-6, AGAIN_SECONDS)
        os._exit(0)  # the parent has ended: nobody waits for an answer

    signal.signal(signal.SIGALRM, interrupt)
    threading.Thread(target=read, daemon=True).start()
    while True:
        number, call = inbox.get()
        try:
            outcome: tuple[float, bool, Any]
            try:
                function, arguments = pickle.loads(call)  # here: two threads that import at once may deadlock
                current = number
                if current <= given_up:
                    continue
                outcome = number, True, function(*arguments)
            finally:
                current = math.inf
        except KeyboardInterrupt:
            continue
        except Exception as error:
            outcome = number, False, error
        pickle.dump(outcome, answers)
        answers.flush()
