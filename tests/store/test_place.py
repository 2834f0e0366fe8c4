"""One module decides whether a file may be written, before any computation."""

import os
from pathlib import Path

import h5py
import numpy as np
import pytest

from vibrodrive.errors import ConfigError, NoResult
from vibrodrive.model.plan import make_plan
from vibrodrive.store.layout import Origin
from vibrodrive.store.place import check_figure, check_output
from vibrodrive.store.writer import open_writer


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    """Work in a directory with a configuration, and with files and links that no result may replace."""
    monkeypatch.chdir(tmp_path)
    for name in ("c.toml", "precious.h5"):
        Path(name).write_text("[sweep]\n")
    Path("folder").mkdir()
    Path("empty.h5").touch()
    with h5py.File("foreign.h5", "w") as file:  # of another program, with some of the names of this program
        file["A"] = np.arange(3.0)
        file["section_xi"] = np.arange(6.0)
        file.attrs["title"] = "precious"
    Path("cut.h5").write_bytes(Path("foreign.h5").read_bytes()[:500])
    for name, target in (("there", "."), ("link.h5", "c.toml"), ("loop.h5", "loop.h5"), ("loop", "loop")):
        Path(name).symlink_to(target)
    os.link("c.toml", "hard.h5")
    os.mkfifo("pipe.h5")


def a_sweep(name):
    open_writer(Path(name), make_plan({"A": [1.0], "periods": 1}), Origin("")).close()
    return Path(name)


def refused(output, words, overwrite=(False, True), config="c.toml"):
    for each in overwrite:
        with pytest.raises((ConfigError, NoResult)) as caught:
            check_output(Path(output), Path(config), overwrite=each)
        assert [w for w in words if w.format(output) not in str(caught.value)] == [], str(caught.value)


@pytest.mark.parametrize(
    ("outputs", "words"),
    [
        ("c.toml ./folder/../c.toml link.h5 hard.h5", ["output", "another file", "c.toml"]),
        ("x.png x.PDF x.svg", ["output = '{}'", "must be a result file (.h5 or .nc)", "plot FILE.h5 -o {}"]),
        ("x x.csv x.nc.txt", ["output = '{}'", "must be a result file (.h5 or .nc)"]),
        ("precious.h5 empty.h5 foreign.h5", ["{}", "only result files"]),
        ("loop.h5 loop/x.h5", ["{}", "symbolic links"]),
        ("pipe.h5", ["{}", "a named pipe"]),
        (".", ["a directory"]),
        ("nowhere/x.h5", ["{}", "directory that exists"]),
    ],
)
def test_result_replaces_result_files_only(outputs, words):
    for output in outputs.split():
        refused(output, words)


def test_result_files_are_replaced():
    for allowed in ("x.h5", "x.H5", "x.nc"):
        check_output(Path(allowed), None, overwrite=False)
    refused("cut.h5", ["cut.h5", "only result files"], overwrite=[True])  # else it may be a damaged result file
    for overwrite in (False, True):
        check_output(a_sweep("s.h5"), None, overwrite=overwrite)


def test_file_that_is_mounted_alone_is_not_to_be_replaced(monkeypatch):
    """As a file of a container: the system would refuse the renaming at the end. It may be resumed."""
    a_sweep("a.h5")
    monkeypatch.setattr(os.path, "ismount", lambda path: os.path.basename(path) == "a.h5")
    refused("a.h5", ["mounted alone"], overwrite=[True])
    check_output(Path("a.h5"), None, overwrite=False)


@pytest.mark.parametrize("spelling", ["new.png", "./new.png", "folder/../new.png", "there/new.png"])
def test_figure_may_not_have_the_path_of_a_new_map(spelling):
    """Neither file exists yet. The file that is written last would replace the other one."""
    with pytest.raises(ConfigError, match="another file than the map"):
        check_figure(Path(spelling), {"map": Path("new.png")})


def test_directory_without_permission_is_refused():
    Path("locked").mkdir()
    a_sweep("locked/s.h5")
    Path("locked").chmod(0o555)
    try:
        if os.access("locked", os.W_OK):
            pytest.skip("the superuser may write anywhere")
        refused("locked/x.h5", ["locked/x.h5", "write permission"])
        refused("locked/s.h5", ["locked/s.h5", "write permission"], overwrite=[True])
        with pytest.raises(ConfigError, match="write permission"):
            check_figure(Path("locked/x.png"), {})
    finally:
        Path("locked").chmod(0o755)
