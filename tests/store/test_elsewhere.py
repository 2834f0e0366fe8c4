"""Where there is no POSIX: everything is imported, and a sweep goes to a file and on, without what Windows lacks."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from vibrodrive.model.plan import make_plan
from vibrodrive.store import lock, system, writer
from vibrodrive.store.layout import Origin
from vibrodrive.store.lock import Busy, Lock
from vibrodrive.store.reader import load_sweep

WITHOUT_POSIX = """
import importlib, os, pkgutil, signal, sys
import fcntl as posix
for name in ("fcntl", "resource", "pwd", "grp", "termios"):
    sys.modules[name] = None
for name in ("sysconf", "getuid", "O_NONBLOCK", "sched_getaffinity"):
    delattr(os, name)
del signal.SIGHUP

from vibrodrive.store import system


def lock_byte(fd, exclusive):
    posix.flock(fd, posix.LOCK_NB | (posix.LOCK_EX if exclusive else posix.LOCK_SH))


system._lock_byte = lock_byte
system.RENAMES_OPEN_FILES = False

replace = os.replace


def replace_closed(source, target):
    for path in (source, target):
        for fd in os.listdir("/proc/self/fd"):
            try:
                if os.path.samefile(f"/proc/self/fd/{fd}", path):
                    raise PermissionError(13, "open", str(path))
            except FileNotFoundError:
                pass
    replace(source, target)


if os.path.isdir("/proc/self/fd"):
    os.replace = replace_closed

if "--overwrite" not in sys.argv:  # once is enough
    import vibrodrive
    for module in pkgutil.walk_packages(vibrodrive.__path__, "vibrodrive."):
        try:
            if not module.name.endswith("__main__"):
                importlib.import_module(module.name)
        except ModuleNotFoundError as error:
            if error.name not in ("mpmath", "bokeh"):  # extras
                raise
from vibrodrive.cli import main
main(sys.argv[1:])
"""


def run(folder, *arguments):
    root = Path(__file__).parents[2]
    return subprocess.run(
        [sys.executable, "-c", WITHOUT_POSIX, *arguments],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(root), "PYTHONUTF8": "0", "PYTHONIOENCODING": "cp1252"},
        capture_output=True,
    )


@pytest.mark.jit
def test_a_sweep_without_posix(tmp_path):
    (tmp_path / "few.toml").write_text(
        "[sweep]\nA = {start = 3.0, stop = 3.2, num = 5}\n[run]\ntransient = 2\nperiods = 3\n"
    )
    sweep = ("sweep", "few.toml", "-o", "few.h5")
    for command in (sweep, (*sweep, "--set", "periods=4", "--overwrite")):
        done = run(tmp_path, *command)
        assert done.returncode == 0, done.stderr.decode("cp1252")
    assert load_sweep(tmp_path / "few.h5").section.shape == (5, 4, 2)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["few.h5", "few.toml"]


def test_a_file_that_gets_its_name_closed_is_locked_and_written_as_ever(tmp_path, monkeypatch):
    monkeypatch.setattr(system, "RENAMES_OPEN_FILES", False)
    path = tmp_path / "x.h5"
    plan = make_plan({"A": np.linspace(3, 3.2, 4), "transient": 0, "periods": 2})
    for overwrite in (False, True):
        held = writer.open_writer(path, plan, Origin(""), overwrite=overwrite)
        assert lock.is_being_written(path) in (True, None)
        with pytest.raises(Busy, match="another process is writing it"):
            Lock(path)
        held.close()
        assert lock.is_being_written(path) in (False, None)
    assert [p.name for p in tmp_path.iterdir()] == ["x.h5"]


def test_a_lock_may_be_given_back_twice(tmp_path):
    first = Lock(tmp_path / "x", create=True)
    first.release()
    first.release()
    second = Lock(tmp_path / "x")
    first.release()
    with pytest.raises(Busy):
        Lock(tmp_path / "x")
    second.release()
