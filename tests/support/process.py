"""Execution of Python code in a separate process."""

import os
import subprocess
import sys
from pathlib import Path

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
