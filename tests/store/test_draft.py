"""Every writer makes a complete file, or no file."""

import os
import resource
import signal
import stat
import sys
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from vibrodrive.errors import Busy
from vibrodrive.figures.style import save
from vibrodrive.model.plan import make_plan
from vibrodrive.store import draft as drafts
from vibrodrive.store import lock as locks
from vibrodrive.store.draft import draft_of, drafted
from vibrodrive.store.layout import Origin
from vibrodrive.store.lock import Lock
from vibrodrive.store.tables import write_table
from vibrodrive.store.writer import open_writer


def a_table(path):
    write_table(path, ["A"], ((float(k),) for k in range(10_000)))


def a_sweep(path):
    open_writer(path, make_plan({"A": [1.0], "periods": 1}), Origin(""), overwrite=True).close()


def a_figure(path):
    figure = Figure()
    figure.subplots().plot([0, 1])
    save(figure, path)


WRITERS = pytest.mark.parametrize(("write", "name"), [(a_table, "x.csv"), (a_sweep, "x.h5"), (a_figure, "x.png")])


@WRITERS
def test_every_writer_uses_a_draft(write, name, tmp_path, monkeypatch):
    """Every file is written to a temporary file, which is renamed once. If the renaming fails, no file remains."""
    renamed, target = [], tmp_path / name

    def refuse(source, to):
        renamed.append((Path(source), Path(to)))
        raise OSError(13, "Permission denied", str(source))

    with monkeypatch.context() as m:
        m.setattr(drafts.os, "replace", refuse)
        with pytest.raises(OSError, match="Permission denied") as caught:
            write(target)
    assert renamed == [(draft_of(target), target)]
    assert caught.value.filename == str(target)  # the name that the user has given, and not that of the temporary file
    assert list(tmp_path.iterdir()) == []
    write(target)
    assert list(tmp_path.iterdir()) == [target]


@pytest.fixture
def small_disk(monkeypatch):
    """Limit files to 2000 bytes, which has the same effect as a full disk."""
    monkeypatch.setattr(sys, "dont_write_bytecode", True)  # an imported module would be stored in part, and stay so
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (2000, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, before)
    signal.signal(signal.SIGXFSZ, handler)


@pytest.mark.parametrize(("write", "name"), [(a_table, "x.csv"), (a_figure, "x.png")])
def test_full_disk_is_reported_with_the_file_name(write, name, tmp_path, small_disk):
    with pytest.raises(OSError, match="File too large") as caught:
        write(tmp_path / name)
    assert caught.value.filename == str(tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_failure_keeps_the_older_file_and_links(tmp_path):
    there, link = tmp_path / "there.txt", tmp_path / "link.txt"
    there.write_text("old")
    link.symlink_to("there.txt")

    def half_a_file():
        with drafted(link) as draft:
            draft.write_text("half")
            raise KeyError

    with pytest.raises(KeyError):
        half_a_file()
    assert there.read_text() == "old"
    with drafted(link) as draft:
        draft.write_text("new")
    assert (there.read_text(), link.is_symlink()) == ("new", True)
    assert {p.name for p in tmp_path.iterdir()} == {"there.txt", "link.txt"}


@WRITERS
def test_replaced_file_leaves_its_permissions(write, name, tmp_path):
    """A group that could read and write the older file can do so with the new one, whatever the umask."""
    path = tmp_path / name
    write(path)
    path.chmod(0o664)
    before = os.umask(0o077)
    try:
        write(path)
        assert stat.S_IMODE(path.stat().st_mode) == 0o664
        write(tmp_path / f"new{name}")
        assert stat.S_IMODE((tmp_path / f"new{name}").stat().st_mode) == 0o600
    finally:
        os.umask(before)


def test_lock_may_be_released_twice(tmp_path):
    first = Lock(tmp_path / "x", create=True)
    first.release()
    first.release()
    second = Lock(tmp_path / "x")
    first.release()
    with pytest.raises(Busy):
        Lock(tmp_path / "x")
    second.release()


def test_lock_belongs_to_the_file_of_the_name(tmp_path, monkeypatch):
    """Another process may replace the file after it was opened. A lock of the old file would be useless."""
    path, newer, take = tmp_path / "x", tmp_path / "newer", locks._lock
    path.touch()
    newer.touch()

    def replace_and_take(fd):
        if newer.exists():
            newer.replace(path)
        return take(fd)

    monkeypatch.setattr(locks, "_lock", replace_and_take)
    held = Lock(path)
    with pytest.raises(Busy):
        Lock(path)
    held.release()


def test_name_may_be_as_long_as_the_system_allows(tmp_path):
    path = tmp_path / ("n" * 252 + ".h5")
    a_sweep(path)
    assert list(tmp_path.iterdir()) == [path]
    others = tmp_path / ("m" * 252 + ".h5"), path.with_suffix(".nc")
    assert draft_of(path) not in map(draft_of, others)
