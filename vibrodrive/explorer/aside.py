"""Long exact work (orbits, bifurcations, limits) in a process of its own, which an interrupt ends at any point.

These searches are loops in Python without a flag to look at. But Ctrl-C ends them at once, wherever they are: so they
run in a process whose only business they are, and one that nobody waits for any more is sent that signal. The process
stays, its kernels loaded, for the next one.
"""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from typing import Any, BinaryIO

from vibrodrive.jit.slices import Halt, Halted

LOOK_SECONDS = 0.02
"""How often the flag is looked at while the other process computes."""

GRACE_SECONDS = 1.0
"""How long an interrupted search may take to end: longer it compiles, and its process is ended."""


class Aside:
    """The other process, started when it is first needed."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None

    def call(self, halt: Halt, function: Callable[..., Any], *arguments: Any) -> Any:
        """What the function, found by its name in the other process, returns for these arguments.

        Raises
        ------
        Halted
            if the flag is set meanwhile; then the search ends, too.
        Exception
            that of the function.
        """
        process = self._started()
        assert process.stdin is not None
        assert process.stdout is not None
        answer: list[tuple[bool, Any]] = []
        try:
            pickle.dump((function, arguments), process.stdin)
            process.stdin.flush()
        except OSError:  # it has been killed meanwhile
            self.close()
            raise RuntimeError("the process for exact work has ended") from None
        reader = threading.Thread(target=_receive, args=(process.stdout, answer), daemon=True)
        reader.start()
        while reader.is_alive():
            reader.join(LOOK_SECONDS)
            if halt.called and reader.is_alive():
                process.send_signal(signal.SIGINT)
                reader.join(GRACE_SECONDS)
                if reader.is_alive():
                    self.close()
                raise Halted
        if not answer:
            self.close()
            if halt.called:  # interrupted before it could refuse to be
                raise Halted
            raise RuntimeError("the process for exact work has ended")
        good, value = answer[0]
        if not good:
            raise value
        return value

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.kill()
            with self._process:  # waits, and closes the pipes
                self._process = None

    def _started(self) -> subprocess.Popen[bytes]:
        if self._process is not None and self._process.poll() is not None:
            self.close()
        if self._process is None:
            code = f"from {__name__} import serve; serve()"
            self._process = subprocess.Popen(
                [sys.executable, "-c", code],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                env={**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)},
                start_new_session=True,  # Ctrl-C on the terminal is for the parent
            )
        return self._process


def _receive(stream: BinaryIO, answer: list[tuple[bool, Any]]) -> None:
    try:
        answer.append(pickle.load(stream))
    except (EOFError, OSError, pickle.UnpicklingError):
        return


def serve() -> None:
    """The other process: answers what is written to its standard input until that is closed."""
    requests, answers = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a library prints is no answer
    busy = False

    def interrupt(signum: int, frame: object) -> None:
        if busy:
            raise KeyboardInterrupt

    signal.signal(signal.SIGINT, interrupt)
    inbox: list[Any] = []
    arrived = threading.Semaphore(0)

    def read() -> None:
        try:
            while True:
                inbox.append(pickle.load(requests))
                arrived.release()
        except EOFError:
            os._exit(0)  # the parent has ended: nobody waits for an answer

    threading.Thread(target=read, daemon=True).start()
    while True:
        arrived.acquire()
        function, arguments = inbox.pop(0)
        outcome: tuple[bool, Any]
        try:
            busy = True
            outcome = True, function(*arguments)
            busy = False
        except KeyboardInterrupt:
            outcome = False, None
        except Exception as error:
            outcome = False, error
        busy = False
        pickle.dump(outcome, answers)
        answers.flush()
