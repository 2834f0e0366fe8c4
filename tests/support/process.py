"""Execution of Python code, and of sweeps that may be killed, in separate processes."""

import os
import subprocess
import sys
import time
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import vibrodrive as vd
from vibrodrive.store.reader import look

ROOT = Path(__file__).parents[2]


def python(code: str, *arguments: str, **environment: str) -> str:
    """Run Python code with the given arguments and additional environment variables, and return its output.

    The process must end with exit code 0 and without an error message.
    """
    done = subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)],
        env=os.environ | {"PYTHONPATH": str(ROOT)} | environment,
        capture_output=True,
        text=True,
        timeout=1200,
    )
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


LIMIT = 1200.0
"""Seconds after which a test stops waiting for a process or for blocks."""


def contents(path: Path) -> dict[str, bytes]:
    """Return the numbers of a complete file."""
    results = vd.load(path)
    assert results.computed == 1.0
    return {name: results[name].tobytes() for name in ("section", "status", "margin", "switches")}


@dataclass
class Sweeping:
    """Directory with a configuration c.toml, and the processes that compute it."""

    folder: Path
    started: list[subprocess.Popen] = field(default_factory=list)

    @property
    def file(self) -> Path:
        return self.folder / "c.h5"

    def start(self, *options, front=("-m", "vibrodrive"), **popen):
        process = subprocess.Popen(
            [sys.executable, *front, "sweep", "c.toml", *options],
            cwd=self.folder,
            env=os.environ | {"PYTHONPATH": str(ROOT)},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            **popen,
        )
        self.started.append(process)
        return process

    def end(self, process, code=0):
        """Wait for the end of a process, which must have this exit code, and return its messages."""
        _, err = process.communicate(timeout=LIMIT)
        assert (process.returncode, "Traceback" in err) == (code, False), err
        return err

    def wait_for_blocks(self, process, count=1):
        """Wait until the file exists and contains `count` blocks."""
        limit = time.monotonic() + LIMIT
        while not (self.file.exists() and look(self.file).done.sum() >= count):
            assert process.poll() is None, process.stderr.read()
            assert time.monotonic() < limit, "no blocks"
            time.sleep(0.005)


@contextmanager
def sweeping(folder: Path, config: str):
    """Yield a Sweeping of this configuration, and end its processes, which may be stopped, or run for hours."""
    (folder / "c.toml").write_text(config)
    found = Sweeping(folder)
    yield found
    for process in found.started:
        process.kill()
        with process:  # closes its pipes
            pass
