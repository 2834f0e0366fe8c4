"""One module decides whether a file may be written, before any computation."""

import os
from pathlib import Path

import h5py
import numpy as np
import pytest

from vibrodrive.errors import ConfigError, NoResult
from vibrodrive.model.drawing import FORMATS
from vibrodrive.model.plan import make_plan
from vibrodrive.store.draft import draft_of
from vibrodrive.store.layout import Origin
from vibrodrive.store.place import check_figure, check_output
from vibrodrive.store.writer import open_writer


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("c.toml").write_text("[sweep]\n")


def a_sweep(name):
    open_writer(Path(name), make_plan({"A": [1.0], "periods": 1}), Origin("")).close()
    return Path(name)


def foreign(name):
    """Write an HDF5 file of another program that contains some of the names in files of this program."""
    with h5py.File(name, "w") as file:
        file["A"] = np.arange(3.0)
        file["section_xi"] = np.arange(6.0)
        file.attrs["title"] = "precious"


def refused(output, words, overwrite=(False, True), config="c.toml", figures=()):
    for each in overwrite:
        with pytest.raises((ConfigError, NoResult)) as caught:
            check_output(Path(output), Path(config), overwrite=each, figures=figures)
        assert [w for w in words if w not in str(caught.value)] == [], str(caught.value)


@pytest.mark.parametrize("spelling", ["c.toml", "./x/../c.toml", "link.h5", "hard.h5"])
def test_result_never_replaces_its_configuration(spelling):
    Path("x").mkdir()
    Path("link.h5").symlink_to("c.toml")
    os.link("c.toml", "hard.h5")
    refused(spelling, ["output", "another file", "c.toml"])


def test_draft_never_replaces_the_configuration():
    Path("c.h5.part").write_text("[sweep]\n")
    refused("c.h5", ["temporary file of the output", "c.h5.part"], config="c.h5.part")
    Path("c.png.part").write_text("[sweep]\n")
    with pytest.raises(ConfigError, match="another file"):
        check_figure(Path("c.png"), {"configuration": Path("c.png.part")})
    assert draft_of(Path("c.png")).resolve() == Path("c.png.part").resolve()


@pytest.mark.parametrize("spelling", ["new.png", "./new.png", "x/../new.png", "there/new.png"])
def test_figure_may_not_have_the_path_of_a_new_map(spelling):
    """Neither file exists yet. The file that is written last would replace the other one."""
    Path("x").mkdir()
    Path("there").symlink_to(".")
    with pytest.raises(ConfigError, match="another file than the map"):
        check_figure(Path(spelling), {"map": Path("new.png")})


@pytest.mark.parametrize("name", ["x.png", "x.PDF", "x.svg", "x", "x.csv", "x.nc.txt"])
def test_ending_of_a_result_is_h5_or_nc(name):
    picture = f"plot FILE.h5 -o {name}" if name.lower().endswith(FORMATS) else ""
    refused(name, ["output", name, "must be a result file (.h5 or .nc)", picture])
    for allowed in ("x.h5", "x.H5", "x.nc"):
        check_output(Path(allowed), None, overwrite=False)


def test_only_result_files_are_replaced():
    Path("precious.h5").write_text("precious")
    Path("empty.h5").touch()
    foreign("foreign.h5")
    Path("cut.h5").write_bytes(Path("foreign.h5").read_bytes()[:500])
    for name in ("precious.h5", "empty.h5", "foreign.h5"):
        refused(name, [name, "only result files"])
    refused(
        "cut.h5", ["cut.h5", "only result files"], overwrite=[True]
    )  # without `overwrite` the file may be a damaged result file
    for overwrite in (False, True):
        check_output(a_sweep("s.h5"), None, overwrite=overwrite)


def test_impossible_paths_are_refused(tmp_path):
    for name in ("loop.h5", "loop"):
        Path(name).symlink_to(name)
    os.mkfifo("pipe.h5")
    refused("loop.h5", ["loop.h5", "symbolic links"])
    refused("loop/x.h5", ["loop/x.h5", "symbolic links"])
    refused("pipe.h5", ["pipe.h5", "a named pipe"])
    refused(".", ["a directory"])
    refused("nowhere/x.h5", ["nowhere/x.h5", "directory that exists"])


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
