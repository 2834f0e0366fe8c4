"""Result files, tables and figures replace nothing by mistake. Unusable files and paths are refused."""

import os
import resource
import signal
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

import vibrodrive as vd
from tests.cli.test_cli import contents
from tests.support import fake
from vibrodrive.figures import diagrams as figures
from vibrodrive.figures.style import save
from vibrodrive.model import config
from vibrodrive.model.results import Results
from vibrodrive.store.tables import write_table

SWEEP = "[sweep]\nA = {start = 3.0, stop = 3.25, num = 40}\neps = [0, 2e-4]\n[run]\ntransient = 0\nperiods = 6\n"


@pytest.fixture
def run(run):
    """Return the fixture `run` of conftest.py, in a directory with the configuration SWEEP."""
    Path("sweep.toml").write_text(SWEEP)
    return run


def a_sweep(path):
    """Write a file of a sweep, with artificial results."""
    fake.write(path, SWEEP)
    return Path(path)


def assert_refused(run, call, *words, code=2):
    before = contents()
    ended, out, err = run(*call.split())
    assert (ended, out, err.startswith("vibrodrive: "), err.count("\n")) == (code, "", True, 1), err
    assert [w for w in words if w not in err] == [], err
    assert contents() == before


@pytest.mark.integration
def test_overwrite_replaces_a_damaged_result_that_is_recognised(run, quick):
    with h5py.File(a_sweep("s.h5"), "r+") as file:
        file["A"][0] = 7.0
    assert_refused(run, "sweep sweep.toml -o s.h5", "axis A", "restore or delete it", code=1)
    assert run("sweep", "sweep.toml", "-o", "s.h5", "--overwrite")[0] == 0
    assert run("info", "s.h5", "--check")[0] == 0
    Path("s.h5").write_bytes(Path("s.h5").read_bytes()[:5000])
    for option, code in (("", 1), (" --overwrite", 2)):
        assert_refused(run, f"sweep sweep.toml -o s.h5{option}", "truncated", "restore or delete it", code=code)


def test_configuration_may_be_a_pipe(tmp_path):
    """The configuration in `vibrodrive sweep <(…)` is a pipe of the shell."""
    out, into = os.pipe()
    os.write(into, SWEEP.encode())
    os.close(into)
    try:
        assert config.read(Path(f"/dev/fd/{out}")).plan().n_points == 80
    finally:
        os.close(out)


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


def test_full_disk_is_reported_with_the_file_name(tmp_path, small_disk):
    motion = Results(config.parse("[sweep]\nA = 3").plan(), {
        "section": np.ones((250, 2)), "status": np.zeros((), np.int8), "margin": np.ones(()),
        "switches": np.zeros(5, np.int64)})  # fmt: skip
    with pytest.raises(OSError, match="File too large") as error:
        save(figures.poincare(motion), tmp_path / "x.png")
    assert error.value.filename == str(tmp_path / "x.png")
    with pytest.raises(OSError, match="File too large") as error:
        write_table(tmp_path / "x.csv", ["x"], ([k] for k in range(10_000)))
    assert error.value.filename == str(tmp_path / "x.csv")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.integration
def test_sweep_of_one_motion_has_its_section_drawn(run, quick):
    Path("d.toml").write_text(SWEEP + '[figure]\nkind = "bifurcation"\nx = "A"\n')
    code, _, err = run("sweep", "d.toml", "--set", "A=3.17", "--set", "eps=0", "--plot")
    assert code == 0, err
    assert Path("d.png").read_bytes()[:4] == b"\x89PNG"
    (ax,) = vd.load("d.h5").plot().axes
    section = vd.load("d.h5").section
    assert sorted(ax.lines[0].get_xdata()) == pytest.approx(sorted(section[:, 0]), abs=1e-9)
    assert "3.17" in ax.get_title(loc="right")
    assert_refused(run, "plot d.h5 --kind bifurcation", "--kind", "poincare")
