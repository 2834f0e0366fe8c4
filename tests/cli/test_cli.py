"""Commands have the documented exit codes and output, give one line for each error, and import only what they need."""

import csv
import io
import json
import os
import re
import shlex
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import h5py
import numpy as np
import pytest
from matplotlib import image

import vibrodrive as vd
from tests.support import fake
from tests.support.process import python
from vibrodrive.cli import cli, main
from vibrodrive.cli.plain import plain
from vibrodrive.jobs.progress import Show, Tally, duration
from vibrodrive.model import config
from vibrodrive.model.plan import make_plan
from vibrodrive.store.layout import Origin
from vibrodrive.store.tables import read_table

SMALL = """
title = "Small"
[sweep]
A = {start = 3.0, stop = 3.25, num = 40}
eps = [0, 2e-4]
[run]
transient = 0
periods = 6
"""

LIMIT = "[sweep]\nA = [2.5, 2.6]\n[run]\nrecord = 'limit'\nperiods = 60\n"
MAP = "[sweep]\nA = [2.5, 2.7]\nB = [0.09, 0.1, 0.11]\n[run]\nrecord = 'summary'\ntransient = 0\nperiods = 6\n"


@pytest.fixture
def run(run):
    """Return the fixture `run` of conftest.py, in a directory with the configuration SMALL."""
    Path("small.toml").write_text(SMALL)
    return run


def flip_bit(path, name, byte):
    """Flip a bit in a byte of an array of a file."""
    with h5py.File(path) as file:
        start = file[name].id.get_offset()
    raw = bytearray(Path(path).read_bytes())
    raw[start + byte] ^= 4
    Path(path).write_bytes(raw)


def test_only_what_a_command_needs_is_imported(run):
    """Light: the import of the package, and --help. Without Numba: commands that read, draw and check, all modules.

    A figure needs no window system.
    """
    fake.write("s.h5", SMALL)
    code = """if True:
        import sys, vibrodrive as vd
        sys.stderr = sys.stdout
        heavy = {"numba", "llvmlite", "h5py", "matplotlib", "numpy"}
        from vibrodrive.cli import main
        for call in (["sweep", "--help"], ["info", "s.h5"], ["info", "--check", "s.h5"], ["info", "--csv", "s.h5"],
                     ["plot", "s.h5"]):
            assert call[0] != "sweep" or not heavy & {*sys.modules}
            try:
                main(call)
            except SystemExit as end:
                assert end.code == 0, call
            assert not ({"numba", "matplotlib.pyplot"} if call[0] != "sweep" else heavy) & {*sys.modules}, call
        import vibrodrive.batch.sweep, vibrodrive.periodic.search, vibrodrive.stability.limit, vibrodrive.explorer.work
        assert not {"numba", "llvmlite"} & {*sys.modules}
        assert vd.sweep.__name__ == "sweep"  # the function, not a module of this name
        assert all(dir(m) == sorted(m.__all__) for m in (vd, vd.plot, vd.errors))
        print(*(hasattr(vd, name) for name in (*vd.__all__, "nonsense")))
    """
    assert python(code).splitlines()[-1] == " ".join(["True"] * len(vd.__all__) + ["False"])


def test_sweep_writes_the_file_of_its_configuration_once(run, quick):
    code, out, err = run("sweep", "small.toml", "--set", "periods=4", "-o", "there.h5")
    assert (code, out, "80 points in" in err) == (0, "", True)
    assert f"points with the status BUDGET: 26; {vd.Status.BUDGET.advice}" in err
    results = vd.load("there.h5")
    assert (results.settings.periods, results.title) == (4, "Small")
    expected = fake.block(config.read("small.toml", ["periods=4"]).plan(), 0).section
    np.testing.assert_array_equal(results.section.reshape(80, 4, 2), expected)
    with h5py.File("there.h5") as file:
        assert file.attrs["config"].decode() == SMALL
    assert sorted(p.name for p in Path().iterdir()) == ["small.toml", "there.h5"]
    before = Path("there.h5").read_bytes()
    quick.clear()
    same = ("sweep", "small.toml", "--set", "periods=4", "-o", "there.h5")
    assert run(*same)[2].startswith("there.h5 is complete: nothing to compute")
    code, _, err = run(*same, "--set", "B=0.2")
    assert (code, err.count("\n"), "B is 0.1 in the file and 0.2 in the configuration" in err) == (2, 1, True)
    assert (quick, Path("there.h5").read_bytes() == before) == ([], True)
    assert run(*same, "--overwrite")[0] == 0
    assert quick == [0]


ORBITS = "orbits small.toml --set eps=0 -o"
TRAJECTORY = "trajectory small.toml --set A=3 --set eps=0 -o"

REFUSED = [
    ("sweep missing.toml", "missing.toml", "No such file"),
    ("sweep", "CONFIG"),
    ("limits limits.toml", "command = 'limits': must be one of init, sweep, plot, info, trajectory, orbits, expl"),
    ("sweep small.toml --nonsense", "--nonsense"),
    ("sweep small.toml --method newton", "--method", "newton", "certified"),
    ("sweep small.toml --threads 0", "--threads", "0"),
    ("sweep small.toml --threads 9999", "--threads = 9999", "<="),
    ("sweep small.toml --set periods=0", "small.toml", "periods = 0", ">= 1"),
    ("sweep small.toml --set A.num=1000000 --set periods=1000000", "TB", "free"),
    ("sweep small.toml --set periods 10", "--set = 'periods': must be KEY=VALUE"),
    ("info limit", "limit: No such file or directory. Did you mean limit.h5?"),
    ("sweep small.toml -o .", "-o", "directory"),
    ("sweep small.toml --plot c1.jpg", "figure = 'c1.jpg'", ".png, .pdf, .svg"),
    ("sweep small.toml other.toml --plot", "other.toml"),
    ("sweep result.h5", "result.h5: must be a configuration", "`vibrodrive plot result.h5` draws it", "repeat the"),
    (["sweep", "small.toml", "-o", ""], "output = ''", "name"),
    (["sweep", "small.toml", "-o", "a\nb.h5"], "output = 'a\\nb.h5'", "control"),
    ("sweep broken.toml", "broken.toml", "invalid TOML", "line 2"),
    ("plot missing.h5", "missing.h5", "No such file"),
    ("plot small.toml", "small.toml: not a result file", "`vibrodrive sweep small.toml --plot`"),
    ("info small.toml", "small.toml", "not a result file"),
    ("info --check small.toml", "small.toml", "not a result file"),
    ("trajectory small.toml", "sweep.A", "40 values", "one number"),
    ("trajectory small.toml --set A=3 --set eps=0 -o t.doc", "--output = 't.doc'", ".csv", ".png, .pdf, .svg"),
    ("trajectory small.toml --set A=3 --set eps=0 -o t.png -o u.svg", "'u.svg'", "at most one of each"),
    ("orbits small.toml", "axes = A, eps: must be one of A, a0, omega0, frequency, alone or with one of B"),
    ("orbits small.toml --set eps=0 --set A=3 --set B=[0.1,0.2]", "axes = B: must be one of A, a0, omega0, frequency"),
    ("orbits small.toml --set eps=0 -o o.h5", "--output = 'o.h5'", "a table (.csv)"),
    ("plot", "FILE..."),
    ("plot limit.h5 result.h5", "result.h5: record = 'section'", '"limit"'),
    ("plot limit.h5 other.h5", "other.h5: axes = A", "the same values in all results"),
    ("plot limit.h5 other.h5 --quantity k2", "--quantity = 'k2'", "left out for several files"),
    ("plot limit.h5 other.h5 --over small.toml", "--over = 'small.toml'", "left out for several"),
    ("plot map.h5 --over small.toml", "small.toml", "not a result file"),
    ("plot map.h5 --over missing.csv", "missing.csv", "No such file"),
    ("plot map.h5 --over result.h5", "--over = 'result.h5'", 'record = "limit"', ".csv"),
    ("plot map.h5 --quantity power", "--quantity = 'power': must be one of", "Did you mean impact_power?"),
    ("sweep small.toml --periods 3", "option = '--periods': must be given as --set periods=…"),
    ("orbits small.toml --max-period=3", "option = '--max-period': must be given as --set max_period=…"),
    ("plot map.h5 --periods 3", "option = '--periods': must be a key of the configuration"),
    ("sweep small.toml --wrong", "No such option", "--wrong"),
    ("init quickstat", "name = 'quickstat': must be one of ", "Did you mean quickstart?"),
    ("plot map.h5 --cmap magna", "--cmap = 'magna': must be a Colormap", "Did you mean magma?"),
    ("plot limit.h5 --cmap magma", "--cmap = 'magma': must be left out for a figure of kind bands"),
    ("plot limit.h5 --over other.h5", "--over = 'other.h5'", "left out for a figure of kind bands"),
    ("explore missing.toml --no-browser", "missing.toml", "No such file"),
    ("sweep idle.toml", "dtau = 0.1: must be left out with method = 'certified', because it is used by"),
    ("sweep small.toml --set figure.style=gaudy", "figure.style = 'gaudy': must be one of screen, print"),
    ("sweep --plot small.toml --set figure.kind=bands", "figure.kind = 'bands'"),
    ("orbits small.toml --set eps=0 --set A=[3]", "A = [3.0]: must be at least two different"),
    ("trajectory points.toml", "sweep.points = 2 points: must be one point (lists with one value)"),
    ("orbits small.toml --set eps=1e-4", "eps = 0.0001: must be 0, because orbits are those of the undis"),
    ("orbits small.toml --set eps=0 --set method=fixed --set dtau=1", "method = 'fixed': must"),
    ("orbits small.toml --set eps=0 --set max_period=0", "orbits.max_period = 0: must be an integer >="),
    ("sweep --plot small.toml --set figure.x=B", "figure.x = 'B': must be one of the axes A, eps"),
    ("sweep c.png --plot=c.png", "figure", "another file", "c.png"),
    ("sweep c.h5.part -o c.h5", "temporary file of the output", "c.h5.part"),
    ("trajectory c.png.part --set A=3 --set eps=0 -o c.png", "temporary file of the figure", "c.png.part"),
    ("sweep c.png.part --plot=c.png -o c.h5", "figure", "another file", "c.png.part"),
    ("orbits c.png --set eps=0 -o c.png", "figure", "another file", "c.png"),
    ("orbits c.csv --set eps=0 -o c.csv", "table", "another file", "c.csv"),
    ("trajectory c.csv.part --set A=3 --set eps=0 -o c.csv", "table", "another file", "c.csv.part"),
    (f"{TRAJECTORY} link.svg", "figure", "another file", "small.toml"),
    ("sweep small.toml -o link.h5 --overwrite", "output", "another file", "small.toml"),
    ("sweep small.toml -o foreign.h5", "only result files"),
    ("plot y.png", "figure", "y.png", "another file"),
    ("plot result.h5", "result.png", "another file"),
    ("plot result.h5 -o result.pdf", "result.pdf", "another file"),
    ("plot result.h5 -o y.png", "y.png", "contains data"),
    ("plot result.h5 --over b.csv -o b.png", "b.png", "another file", "--over[0]"),
    ("plot y.png result.h5 -o result.pdf", "result.pdf", "another file", "result file 1"),
    ("sweep small.toml -o result.h5 --plot", "result.png", "another file"),
    (f"{ORBITS} result.csv", "result.csv", "contains data"),
    *((call, "loop", "symbolic links") for call in (
        "sweep loop.toml", "info loop.h5", "plot map.h5 --over loop.csv -o x.png", f"{ORBITS} loop.csv",
        "plot loop.h5 -o x.png", "plot map.h5 -o loop.png",
    )),
    ("info map.h5/x.h5", "map.h5/x.h5", "Not a directory"),
    ("plot map.h5/x.h5 -o x.png", "map.h5/x.h5", "Not a directory"),
    *((call, "pipe.", "a named pipe") for call in (
        "info pipe.h5", "plot pipe.h5 -o x.png", "plot map.h5 -o pipe.png", f"{TRAJECTORY} pipe.csv",
        "sweep small.toml -o pipe.h5",
    )),
]  # fmt: skip
"""(Arguments of the program, *words of its answer)"""


def contents():
    """Return the contents of all files of the directory, and the targets of links."""
    there = {}
    for p in Path().iterdir():
        there[p.name] = os.readlink(p) if p.is_symlink() else p.read_bytes() if p.is_file() else p.stat().st_mode
    return there


@pytest.fixture
def idle(monkeypatch):
    """Let the test fail if a command begins a computation."""

    def begun(*arguments, **options):
        raise AssertionError("something is computed")

    for name in ("batch.sweep.run_blocks", "batch.trajectory.follow", "jobs.orbits.find"):
        module, _, function = name.rpartition(".")
        monkeypatch.setattr(import_module(f"vibrodrive.{module}"), function, begun)


def test_bad_input_is_one_line_exit_2_and_no_file(run, idle, monkeypatch):
    Path("broken.toml").write_text("[sweep]\nA = = 3\n")
    Path("points.toml").write_text("[sweep.points]\nA = [3.0, 3.1]\n")
    Path("idle.toml").write_text("[sweep]\nA = 3.04\n[switching]\ndtau = 0.1\n")
    for name, text in (("result", SMALL), ("limit", LIMIT), ("other", LIMIT.replace("2.6", "2.7")), ("map", MAP)):
        fake.write(f"{name}.h5", text)
    for name in ("c.png", "c.png.part", "c.csv", "c.csv.part", "c.h5.part"):
        Path(name).write_text(SMALL)
    fake.write("y.h5", SMALL)
    Path("y.h5").rename("y.png")
    Path("b.csv").write_text("A,B\n")
    links = {"result.png": "result.h5", "result.csv": "result.h5", "b.png": "b.csv", "link.svg": "small.toml"}
    for name, target in {**links, "link.h5": "small.toml", "loop.toml": "loop.toml"}.items():
        Path(name).symlink_to(target)
    for end in ("h5", "png", "csv"):
        Path(f"loop.{end}").symlink_to(f"loop.{end}")
        os.mkfifo(f"pipe.{end}")
    os.link("result.h5", "result.pdf")
    with h5py.File("foreign.h5", "w") as file:  # of another program
        file["section_xi"] = np.arange(6.0)
    before = contents()
    for arguments, *words in REFUSED:
        code, out, err = run(*(arguments.split() if isinstance(arguments, str) else arguments))
        assert (code, out, err.startswith("vibrodrive: "), err.count("\n")) == (2, "", True, 1), (arguments, err)
        assert [w for w in words if w not in err] == [], (arguments, err)
        assert contents() == before, arguments


def test_overwrite_replaces_a_damaged_result_that_is_recognised(run, quick):
    def refused(*more, code=1):
        before, (ended, out, err) = contents(), run("sweep", "small.toml", "-o", "s.h5", *more)
        assert (ended, out, err.count("\n"), contents() == before) == (code, "", 1, True)
        return err

    fake.write("s.h5", SMALL)
    with h5py.File("s.h5", "r+") as file:
        file["A"][0] = 7.0
    assert re.search("axis A.*restore or delete it", refused())
    assert run("sweep", "small.toml", "-o", "s.h5", "--overwrite")[0] == 0
    assert run("info", "s.h5", "--check")[0] == 0
    Path("s.h5").write_bytes(Path("s.h5").read_bytes()[:5000])
    for err in (refused(), refused("--overwrite", code=2)):
        assert re.search("truncated.*restore or delete it", err)


def test_sweep_of_one_motion_from_a_pipe_has_its_section_drawn(run, quick):
    """The configuration in `vibrodrive sweep <(…)` is a pipe of the shell."""
    out, into = os.pipe()
    os.write(into, (SMALL + '[figure]\nkind = "bifurcation"\nx = "A"\n').encode())
    os.close(into)
    code, _, err = run(*f"sweep /dev/fd/{out} -o d.h5 --set A=3.17 --set eps=0 --plot d.png".split())
    os.close(out)
    assert code == 0, err
    assert Path("d.png").read_bytes()[:4] == b"\x89PNG"
    (ax,) = vd.load("d.h5").plot().axes
    assert sorted(ax.lines[0].get_xdata()) == pytest.approx(sorted(vd.load("d.h5").section[:, 0]), abs=1e-9)
    assert "3.17" in ax.get_title(loc="right")
    code, _, err = run("plot", "d.h5", "--kind", "bifurcation")
    assert (code, err.count("\n"), "--kind" in err, "poincare" in err) == (2, 1, True, True)


def test_what_is_missing_is_named_in_one_line(run, monkeypatch):
    def fails(*_):
        raise MemoryError("Unable to allocate 1.19 GiB for an array")

    with monkeypatch.context() as m:
        m.setattr("vibrodrive.model.config.read", fails)
        assert run("sweep", "small.toml") == (1, "", "vibrodrive: Unable to allocate 1.19 GiB for an array\n")
    monkeypatch.setattr(import_module("vibrodrive.cli.explore"), "find_spec", lambda name: None)
    told = "vibrodrive: explore needs the extra `explore`: pip install 'vibrodrive[explore]'\n"
    assert run("explore", "--no-browser") == (2, "", told)
    with monkeypatch.context() as m:
        m.setitem(sys.modules, "distributed", None)
        code, _, err = run("sweep", "small.toml", "--dask", "tcp://127.0.0.1:1")
        assert (code, "pip install 'vibrodrive[dask]'" in err, err.count("\n")) == (2, True, 1)
    pytest.importorskip("distributed")
    for address in ("foo", "foo://x:1", "x:port", "inproc://1/2/3"):
        code, _, err = run("sweep", "small.toml", "--dask", address)
        assert (code, err.startswith(f"vibrodrive: --dask {address}: "), err.count("\n")) == (2, True, 1)


def test_what_is_given_in_vain_is_named(run, quick):
    """Tables of other commands, a scene in other units at all points; --method leaves out what it does not use."""
    Path("t.toml").write_text(SMALL + '[orbits]\nmax_period = 2\n[trajectory]\nperiods = 3\n[figure]\nx = "A"\n')
    told = "warning: [trajectory] is not read by `vibrodrive sweep`; [orbits] is not read by `vibrodrive sweep`"
    assert [line for line in run("sweep", "t.toml")[2].splitlines() if "not read" in line] == [told]
    Path("km.toml").write_text("[physical]\na0 = 0.8e-6\nomega0 = 150\nmu = 0.6\nalpha = 3.4\n[run]\nperiods = 1\n")
    for name, more in {"all": [], "some": ["--set", "a0=[0.8e-3, 0.8e-6]"]}.items():
        assert run("sweep", "km.toml", "-o", f"{name}.h5", *more)[2].count("not in SI units") == (name == "all")
    Path("m.toml").write_text('[sweep]\nA = 3\n[switching]\nmethod = "muller"\ntol = 1e-9\ndtau = 0.1\n')
    for method, used in (("certified", set()), ("fixed", {"dtau"}), ("muller", {"dtau", "tol"})):
        assert run("sweep", "m.toml", "--overwrite", "--method", method)[0] == 0
        out = run("info", "m.h5")[1]
        assert {name for name in ("dtau", "tol") if f"{name} =" in out} == used


def test_damaged_blocks_of_a_file_are_reported(run, quick):
    run("sweep", "small.toml")
    flip_bit("small.h5", "section_dxi", 100)
    code, _, err = run("sweep", "small.toml")
    assert (code, "block 0 is damaged" in err) == (0, True)


def test_info_shows_an_unfinished_file_and_writes_json(run, monkeypatch):
    """Unknown numbers are written as null, because JSON has no NaN."""
    text = "[sweep]\nA = {start = 1, stop = 2, num = 3000}\n[run]\ntransient = 0\nperiods = 1\n"
    fake.write("s.h5", text, Origin(text, (), "Half a sweep"), [1])
    code, out, err = run("info", "s.h5", "--json")
    assert (code, err) == (0, "")
    told = json.loads(out, parse_constant=lambda word: pytest.fail(word))
    assert told["title"] == "Half a sweep"
    assert told["blocks"] == {"computed": 1, "of": 3}
    assert told["computed"] == pytest.approx(1 / 3)
    assert told["axes"] == {"A": {"first": 1.0, "last": 2.0, "num": 3000}}
    assert told["settings"]["periods"] == 1
    assert told["statuses"]["NOT_COMPUTED"] == 2000
    words = ("Half a sweep", "33.3 %", "1 of 3", "A = 1 to 2, 3000 values", "NOT_COMPUTED: 2000 points")
    assert [w for w in words if w not in run("info", "s.h5")[1]] == []
    assert run("info", "--check", "s.h5")[2] == "incomplete; the computed part is undamaged\n"
    monkeypatch.setattr(Path, "stat", lambda path: SimpleNamespace(st_size=1, st_mtime=253402300800.5))
    assert run("info", "s.h5")[1].endswith("written   10000-01-01T00:00:00+00:00\n")


SUMMARY = (
    "[physical]\na0 = 8e-4\nmu = 0.6\nalpha = 3\n[sweep]\nfrequency = [20, 24]\neps = [0, 1e-4]\n"
    "[run]\nrecord = 'summary'\nperiods = 66\n"
)


@pytest.mark.parametrize("text", [SMALL, SUMMARY, LIMIT, SUMMARY + "[figure]\nunits = 'dimensionless'\n"])
def test_info_prints_the_numbers_of_the_points_as_csv(run, text):
    fake.write("s.h5", text)
    code, out, err = run("info", "s.h5", "--csv")
    assert (code, err) == (0, "")
    results = vd.load("s.h5")
    read = list(csv.DictReader(io.StringIO(out)))
    for name, values in (results.dimensionless() if "units" in text else results).to_dataframe().items():
        assert [row[name] for row in read] == ["" if v is None else str(v) for v in values.tolist()]
    if text == SUMMARY:
        assert [row["frequency"] for row in read] == ["20.0", "20.0", "24.0", "24.0"]
        one = vd.Scene(a0=8e-4, frequency=24, mu=0.6, alpha=3).length(results.xi_max[1, 1])
        assert float(read[3]["x_max_m"]) == pytest.approx(one)


def test_csv_of_a_file_with_missing_and_damaged_points(run):
    text = "[sweep]\nA = {start = 1, stop = 2, num = 3000}\n[run]\ntransient = 0\nperiods = 1\n"
    fake.write("s.h5", text, Origin(text), [0, 1])
    code, out, err = run("info", "s.h5", "--csv")
    assert (code, err) == (0, "s.h5: 66.7 % computed\n")
    assert out.splitlines()[-1] == "2.0,nan,NOT_COMPUTED"
    flip_bit("s.h5", "margin", 2)
    code, out, err = run("info", "s.h5", "--csv")
    assert (code, out.count(",nan,NOT_COMPUTED\n")) == (1, 2000)
    assert "damaged blocks are left out of margin: block 0" in err
    told = "vibrodrive: --csv: must be given without --check and --json\n"
    assert run("info", "s.h5", "--csv", "--json") == (2, "", told)


def test_init_lists_and_writes_included_configurations(run):
    code, out, _ = run("init")
    names = [line.split()[0] for line in out.splitlines()]
    assert code == 0
    assert {"quickstart", "fig07", "limits", "orbits", "atlas_dtau", "map_AB"} <= set(names)
    for name in names:
        code, out, err = run("init", name)
        assert (code, out) == (0, "")
        text = Path(f"{name}.toml").read_text()
        assert text.startswith("# ")
        assert config.read(Path(f"{name}.toml")).title in run("init")[1]
        said = err.splitlines()
        assert said[0] == f"{name}.toml written:"
        assert said[1].split()[:1] == ["vibrodrive"]
        assert f" {name}.toml" in said[1]
        assert "configs/" not in text
        for line in said[1:]:
            command, *words = shlex.split(line, comments=True)[1:]
            context = cli.commands[command].make_context(command, words)  # raises an error for unknown options
            tables = [*context.params["over"]] if command == "plot" else []
            tables += context.params["outputs"] if command == "orbits" else []
            assert all(path.suffix != ".h5" or path.stem == "limits" for path in tables)
    before = Path("fig07.toml").read_text()
    told = "vibrodrive: output = 'fig07.toml': must be a new file, because this file exists\n"
    assert run("init", "fig07") == (2, "", told)
    assert Path("fig07.toml").read_text() == before
    code, _, err = run("init", "nothing")
    assert (code, "name = 'nothing': must be one of " in err) == (2, True)


def test_figures_of_finished_unfinished_and_damaged_files(run, quick):
    Path("small.toml").write_text(SMALL + '[figure]\nkind = "poincare"\nstyle = "print"\nwidth = "single"\n')
    looks = {}
    for name, call in {
        "small.png": "sweep --plot small.toml",  # as the configuration says
        "mine.SVG": "sweep small.toml --plot mine.SVG",
        "screen.png": "plot small.h5 -o screen.png --style screen --dpi 100",
        "magma.png": "plot small.h5 -o magma.png --kind bifurcation --cmap magma --dpi 100",
        "double.png": "plot small.h5 -o double.png --width double --dpi 100",
    }.items():
        code, _, err = run(*call.split())
        assert (code, f"{name} drawn" in err) == (0, True), err
        if name.endswith("png"):
            drawn = image.imread(name)[..., :3]
            looks[name] = drawn.shape[1], bool(np.ptp(drawn, axis=-1).any())
    assert Path("mine.SVG").read_bytes().startswith(b"<?xml")
    seen = {"small.png": (827, False), "screen.png": (331, True), "double.png": (685, False), "magma.png": (331, True)}
    assert looks == seen
    Path("wide.toml").write_text(SMALL.replace("num = 40", "num = 3000"))
    fake.write("wide.h5", Path("wide.toml").read_text(), which=[1, 2])
    assert run("plot", "wide.h5")[0] == 0, "an unfinished file is sound"
    flip_bit("wide.h5", "section_dxi", 2000 * 6 * 8)  # in block 2
    code, _, err = run("plot", "wide.h5", "-o", "wide.pdf", "--quantity", "xi")
    assert (code, "% computed" in err, "wide.pdf drawn" in err) == (1, True, True)
    assert "wide.h5: damaged blocks are left out of section: block 2 (points 2000 to 2999: A = " in err
    assert Path("wide.pdf").read_bytes()[:4] == b"%PDF"


@pytest.mark.jit
def test_dry_run_writes_nothing_and_estimates_size_and_time(run):
    """tests/jobs/test_estimate.py compares the time with that of sweeps of a known cost."""
    options = ("--set", "A.num=200", "--set", "transient=60", "--set", "periods=600")
    code, out, _ = run("sweep", "small.toml", "-o", "t.h5", "--dry-run", *options)
    assert (code, Path("t.h5").exists()) == (0, False)
    words = dict(line.split(maxsplit=1) for line in out.splitlines())
    assert (words["points"], words["periods"]) == ("400", "2.64e+05 (660 a point, 600 recorded)")
    assert (words["time"].startswith("about "), words["time"].endswith("to load the kernels")) == (True, True)
    run("sweep", "small.toml", "-o", "t.h5", *options)
    assert float(words["file"].split()[0]) == pytest.approx(Path("t.h5").stat().st_size / 1e6, rel=0.02)
    several = {"limit": "each point needs a search with several motions", "failures": "the points are computed one by"}
    for record, why in several.items():
        step = ("--method", "fixed", "--set", "dtau=0.1") if record == "failures" else ()
        out = run("sweep", "small.toml", "--dry-run", "--set", f"record={record}", "--set", "eps=0.0", *step)[1]
        assert f"time     unknown, because {why}" in out


@pytest.mark.jit
def test_trajectory_draws_one_motion_and_writes_its_switches(run):
    options = ("--set", "A=3.04", "--set", "eps=0", "--set", "transient=50")
    Path("small.png").write_text("the diagram of a sweep")
    code, out, err = run("trajectory", "small.toml", *options)
    assert code == 0
    assert out.splitlines()[2].startswith("period 2; impacts per excitation period: 0.5")
    assert Path("small_trajectory.png").read_bytes()[:4] == b"\x89PNG"
    assert Path("small.png").read_text() == "the diagram of a sweep"
    switches = vd.simulate(A=3.04, transient=50, periods=6).switches
    assert f"small_trajectory.png drawn: {len(switches)} switches\n" in err
    code, again, err = run("trajectory", "small.toml", *options, "-o", "t.csv")
    assert (code, again) == (0, out)
    assert err.endswith(f"t.csv written: {len(switches)} switches\n")  # the first line may report the compilation
    table = read_table(Path("t.csv"))
    assert [float(row["xi"]) for row in table] == switches["xi"].tolist()
    assert [row["after"] for row in table] == [vd.State(k).name for k in switches["after"]]
    Path("scene.toml").write_text("[physical]\na0 = 8e-4\nfrequency = 24\nmu = 0.6\nalpha = 3.4\n[run]\nperiods = 3\n")
    assert run("trajectory", "scene.toml", "-o", "si.csv")[0] == 0
    table, scene = read_table(Path("si.csv")), vd.Scene(a0=8e-4, frequency=24, mu=0.6, alpha=3.4)
    switches = vd.simulate(scene=scene, periods=3).switches
    assert [float(row["v_m_per_s"]) for row in table] == pytest.approx(scene.velocity(switches["dxi"]))
    assert {"tau", "xi", "dxi"}.isdisjoint(table[0])


@pytest.mark.jit
def test_orbits_are_printed_drawn_and_written_and_drawn_over_a_map(run):
    axis, runs = "[sweep]\nA = {start = 2.59, stop = 2.62, num = 4}\n", "[run]\ntransient = 50\nperiods = 8\n"
    Path("o.toml").write_text(axis + runs + "[orbits]\nmax_period = 2\n")
    (bifurcation,) = vd.bifurcations((2.59, 2.62), max_period=2)
    code, out, err = run("orbits", "o.toml", "-o", "o.csv", "-o", "o.png")
    assert code == 0
    assert err.endswith("o.csv written\no.png drawn\n")
    line = out.splitlines()[1]
    assert float(line.split()[0]) == pytest.approx(bifurcation.A, abs=1e-13)
    assert "period doubling" in line
    assert "period 1 to 2" in line
    doubling = read_table(Path("o.csv"))[-1]
    assert (doubling["kind"], float(doubling["A"])) == ("period doubling", bifurcation.A)
    assert Path("o.png").read_bytes()[:4] == b"\x89PNG"
    over = ("--set", "B=[0.1, 0.11]", "--set", "A.stop=2.7", "--set", "max_period=1")
    assert run("orbits", "o.toml", "-o", "ab.csv", *over)[0] == 0
    assert [row["B"] for row in read_table(Path("ab.csv"))] == ["0.1", "0.11"]
    fake.write("map.h5", MAP)
    assert run("plot", "map.h5", "-o", "plain.png")[0] == 0
    assert run("plot", "map.h5", "--over", "ab.csv", "-o", "over.png") == (0, "", "over.png drawn\n")
    assert Path("over.png").read_bytes() != Path("plain.png").read_bytes()


class Stream(io.StringIO):
    def __init__(self, terminal):
        super().__init__()
        self.isatty = lambda: terminal


def test_progress_rewrites_a_line_of_a_terminal_and_prints_few_lines_elsewhere(monkeypatch):
    stream = Stream(terminal=True)
    show = Show(stream, "s.h5")
    show.update(lambda: "1 %")
    show.say("done")
    assert stream.getvalue() == "\r\x1b[Ks.h5  1 %\r\x1b[Kdone\n"
    stream.close()  # a closed terminal does not stop the computation
    show.update(lambda: "2 %")
    clock = iter([0.0, 1.0, 9.9, 10.1, 10.1, 15.0, 20.2, 20.2])
    monkeypatch.setattr("time.monotonic", lambda: next(clock))
    stream = Stream(terminal=False)
    show = Show(stream, "s.h5")
    for share in (10, 20, 30, 40, 50):
        show.update(lambda share=share: f"{share} %")
    assert stream.getvalue() == "s.h5  30 %\ns.h5  50 %\n"


def test_progress_shows_rate_and_remaining_time(monkeypatch):
    monkeypatch.setattr("time.monotonic", lambda: 100.0)
    tally = Tally()
    tally.start(make_plan({"A": np.arange(1000.0), "transient": 10, "periods": 40}), done=400)
    assert tally.line() == " 40.0 %"
    monkeypatch.setattr("time.monotonic", lambda: 110.0)
    tally.add(SimpleNamespace(start=400, stop=600, raised=()))
    assert tally.line() == " 60.0 %  1.00e+03 periods/s  20 points/s  20.0 s left"
    tally.periods = 0  # of limits, for which each point needs many motions
    assert tally.line() == " 60.0 %  20 points/s  20.0 s left"
    times = {0.00412: "4.1 ms", 0.314: "0.31 s", 3.21: "3.2 s", 59.97: "1 min 0 s", 7500: "2 h 5 min", 3e5: "3 d 11 h"}
    assert [duration(seconds) for seconds in times] == [*times.values()]


@pytest.mark.jit
@pytest.mark.slow("15 s: 60 000 points, in processes of their own")
def test_memory_does_not_grow_with_the_sweep(run):
    """60 000 points need at most 60 MiB more than 2000 points with blocks of the same size."""
    peak = {}
    for points in (2000, 60_000):
        code = (
            "import resource, sys\nsys.stderr = sys.stdout\nfrom vibrodrive.cli import main\n"
            f"try: main(['sweep', 'small.toml', '-o', '{points}.h5', '--set', 'A.num={points}', "
            "'--set', 'eps=0', '--set', 'periods=500'])\n"
            "except SystemExit as end: assert not end.code\n"
            "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)"
        )
        if not peak:
            python(code)  # compiles the kernels, which also needs memory
            Path(f"{points}.h5").unlink()
        peak[points] = int(python(code).splitlines()[-1])
    assert peak[60_000] - peak[2000] < 60 * 1024


def test_ctrl_c_during_imports_prints_one_line():
    script = """if True:
        import os, signal, sys

        class Interrupts:
            def find_spec(self, name, path, target=None):
                if name == "vibrodrive.cli.sweep":
                    os.kill(os.getpid(), signal.SIGINT)

        sys.meta_path.insert(0, Interrupts())
        from vibrodrive.__main__ import main
        main()
    """
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=1200, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "vibrodrive: stopped by SIGINT\n")


def test_truncated_module_is_no_interruption(monkeypatch):
    """Python raises EOFError for a module of which the system has stored a part, and Click for Ctrl-D at a prompt."""

    def truncated(*arguments, **options):
        raise EOFError("marshal data too short")

    monkeypatch.setattr("vibrodrive.model.packaged.titles", truncated)
    with pytest.raises(EOFError, match="too short"):
        main(["init"])


def test_neither_a_closed_stream_nor_the_backend_of_a_display_stops_a_command(tmp_path):
    fake.write(tmp_path / "small.h5", SMALL)
    command = f'exec "{sys.executable}" -m vibrodrive plot small.h5 2>&-'
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2]), "MPLBACKEND": "nonsense"}
    done = subprocess.run(["sh", "-c", command], cwd=tmp_path, env=environment, timeout=1200, check=False)
    assert done.returncode == 0
    assert (tmp_path / "small.png").stat().st_size > 0
    told = python("from vibrodrive.cli import main; main(['trajectory', '--help'])", PYTHONIOENCODING="latin-1")
    assert "?" in told, "a terminal without the letter ξ"


LOSSES = {
    "moved": lambda: os.rename("small.h5", "elsewhere.h5"),
    "deleted": lambda: os.remove("small.h5"),
    "replaced": lambda: os.rename("b.h5", "small.h5"),
}


@pytest.mark.parametrize("first", [False, True], ids=["after the last block", "before a block"])
@pytest.mark.parametrize("lose", LOSSES.values(), ids=LOSSES)
def test_losing_the_file_ends_a_sweep(run, quick, monkeypatch, lose, first):
    """A file of this name, of the same sweep and complete, is not the file that is written."""
    run("sweep", "small.toml", "-o", "b.h5")
    other = Path("b.h5").read_bytes()

    def blocks(plan, which=None, **options):
        if first:
            lose()
        yield from fake.run_blocks(plan, which)
        if not first:
            lose()

    monkeypatch.setattr(import_module("vibrodrive.batch.sweep"), "run_blocks", blocks)
    code, _, err = run("sweep", "small.toml")
    told = "vibrodrive: small.h5: moved, deleted or replaced while it was written"
    assert (code, err.splitlines()[-1]) == (1, told)
    assert not Path("small.h5").exists() or Path("small.h5").read_bytes() == other


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
