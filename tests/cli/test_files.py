"""Result files, tables and figures replace nothing by mistake. Unusable files and paths are refused."""

import json
import os
import resource
import signal
import sys
from importlib import import_module
from pathlib import Path

import h5py
import numpy as np
import pytest

import vibrodrive as vd
from tests.support import fake
from vibrodrive.cli.plain import plain
from vibrodrive.figures import diagrams as figures
from vibrodrive.figures.style import save
from vibrodrive.model import config
from vibrodrive.model.results import Results
from vibrodrive.store.tables import write_table

SWEEP = "[sweep]\nA = {start = 3.0, stop = 3.25, num = 40}\neps = [0, 2e-4]\n[run]\ntransient = 0\nperiods = 6\n"
ORBITS = "orbits sweep.toml --set eps=0 -o"
TRAJECTORY = "trajectory sweep.toml --set A=3 --set eps=0 -o"


@pytest.fixture
def run(run):
    """Return the fixture `run` of conftest.py, in a directory with the configuration SWEEP."""
    Path("sweep.toml").write_text(SWEEP)
    return run


@pytest.fixture
def idle(monkeypatch):
    """Let the test fail if a command begins a computation."""

    def begun(*arguments, **options):
        raise AssertionError("something is computed")

    for name in ("batch.sweep.run_blocks", "batch.trajectory.follow", "jobs.orbits.find"):
        module, _, function = name.rpartition(".")
        monkeypatch.setattr(import_module(f"vibrodrive.{module}"), function, begun)


def a_sweep(path):
    """Write a file of a sweep, with artificial results."""
    fake.write(path, SWEEP)
    return Path(path)


def contents():
    """Return the contents of all files of the directory, and the targets of links."""
    there = {}
    for p in Path().iterdir():
        there[p.name] = os.readlink(p) if p.is_symlink() else p.read_bytes() if p.is_file() else p.stat().st_mode
    return there


def assert_refused(run, call, *words, code=2):
    before = contents()
    ended, out, err = run(*call.split())
    assert (ended, out) == (code, ""), err
    assert err.startswith("vibrodrive: ")
    assert err.count("\n") == 1
    assert [w for w in words if w not in err] == [], err
    assert contents() == before


def test_figures_and_tables_never_replace_the_configuration(run, idle):
    Path("link.svg").symlink_to("sweep.toml")
    Path("link.h5").symlink_to("sweep.toml")
    for role, name, call in (
        ("figure", "c.png", "sweep c.png --plot=c.png"),
        ("figure", "c.png.part", "sweep c.png.part --plot=c.png -o c.h5"),
        ("figure", "c.png", "orbits c.png --set eps=0 -o c.png"),
        ("table", "c.csv", "orbits c.csv --set eps=0 -o c.csv"),
        ("table", "c.csv.part", "trajectory c.csv.part --set A=3 --set eps=0 -o c.csv"),
        ("figure", "sweep.toml", f"{TRAJECTORY} link.svg"),
        ("output", "sweep.toml", "sweep sweep.toml -o link.h5 --overwrite"),
    ):
        Path(name).write_text(SWEEP)
        assert_refused(run, call, role, "another file", name)


def test_figures_and_tables_never_replace_a_result(run, idle):
    a_sweep("s.h5")
    a_sweep("y.h5").rename("y.png")
    Path("b.csv").write_text("A,B\n")
    for name, target in {"s.png": "s.h5", "s.csv": "s.h5", "b.png": "b.csv"}.items():
        Path(name).symlink_to(target)
    os.link("s.h5", "s.pdf")
    with h5py.File("foreign.h5", "w") as file:  # of another program
        file["section_xi"] = np.arange(6.0)
    for call, *words in (
        ("sweep sweep.toml -o foreign.h5", "only result files"),
        ("sweep sweep.toml -o foreign.h5 --overwrite", "only result files"),
        ("plot y.png", "figure", "y.png", "another file"),
        ("plot s.h5", "s.png", "another file"),
        ("plot s.h5 -o s.pdf", "s.pdf", "another file"),
        ("plot s.h5 -o y.png", "y.png", "contains data"),
        ("plot s.h5 --over b.csv -o b.png", "b.png", "another file", "--over[0]"),
        ("plot y.png s.h5 -o s.pdf", "s.pdf", "another file", "result file 1"),
        ("sweep sweep.toml -o s.h5 --plot", "s.png", "another file"),
        (f"{ORBITS} s.csv", "s.csv", "contains data"),
    ):
        assert_refused(run, call, *words)


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


@pytest.mark.integration
def test_loops_and_pipes_are_refused_by_readers_and_figures(run, idle):
    a_sweep("s.h5")
    for end in ("h5", "png", "csv"):
        Path(f"loop.{end}").symlink_to(f"loop.{end}")
        os.mkfifo(f"pipe.{end}")
    Path("loop.toml").symlink_to("loop.toml")
    for calls, *words in (
        (("sweep loop.toml", "info loop.h5", "plot s.h5 --over loop.csv -o x.png", f"{ORBITS} loop.csv",
          "plot loop.h5 -o x.png", "plot s.h5 -o loop.png"), "loop", "symbolic links"),
        (("info s.h5/x.h5", "plot s.h5/x.h5 -o x.png"), "s.h5/x.h5", "Not a directory"),
        (("info pipe.h5", "plot pipe.h5 -o x.png", "plot s.h5 -o pipe.png", f"{TRAJECTORY} pipe.csv",
          "sweep sweep.toml -o pipe.h5"), "pipe.", "a named pipe"),
    ):  # fmt: skip
        for call in calls:
            assert_refused(run, call, *words)


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


def test_bad_scheduler_addresses_and_a_missing_extra_are_refused(run, idle, monkeypatch):
    with monkeypatch.context() as without:
        without.setitem(sys.modules, "distributed", None)
        assert_refused(run, "sweep sweep.toml --dask tcp://127.0.0.1:1", "pip install 'vibrodrive[dask]'")
    pytest.importorskip("distributed")
    for address in ("foo", "foo://x:1", "x:port", "inproc://1/2/3"):
        assert_refused(run, f"sweep sweep.toml --dask {address}", f"--dask {address}: ")


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


def test_numbers_become_json():
    numbers = [
        np.float64(1.5),
        np.int64(2),
        np.bool_(True),
        np.nan,
        [np.inf, (1,)],
        np.array([1.0, np.nan]),
        np.array(3),
    ]
    assert plain(numbers) == [1.5, 2, True, None, [None, [1]], [1.0, None], 3]
    json.dumps(plain(numbers), allow_nan=False)
