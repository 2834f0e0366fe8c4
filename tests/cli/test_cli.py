"""Commands have the documented exit codes and output, give one line for each error, and import only what they need."""

import io
import json
import os
import shlex
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import h5py
import numpy as np
import pytest
from matplotlib import image

import vibrodrive as vd
from tests.support import fake
from tests.support.process import python
from vibrodrive.cli import cli
from vibrodrive.jobs.progress import Show, Tally, duration
from vibrodrive.jobs.tables import read_table
from vibrodrive.model import config
from vibrodrive.model.plan import make_plan
from vibrodrive.store.layout import Origin

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
FAILURES = """
[sweep]
A = [1.5, 3.04]
dtau = [0.01, 0.1]
[model]
eps = 2e-4
[switching]
method = "fixed"
[run]
record = "failures"
transient = 20
periods = 10
"""
ONE = ("--set", "A=3", "--set", "eps=0")


@pytest.fixture
def run(run):
    """Return the fixture `run` of conftest.py, in a directory with the configuration SMALL."""
    Path("small.toml").write_text(SMALL)
    return run


def flip_bit(path, name, byte, chunk=0):
    """Flip a bit in a byte of a chunk of an array of a file."""
    with h5py.File(path) as file:
        start = file[name].id.get_chunk_info(chunk).byte_offset
    raw = bytearray(Path(path).read_bytes())
    raw[start + byte] ^= 4
    Path(path).write_bytes(raw)


def test_help_imports_nothing_heavy():
    heavy = ("numba", "llvmlite", "h5py", "matplotlib", "numpy")
    code = (
        "import sys\nfrom vibrodrive.cli import main\n"
        "try: main(['sweep', '--help'])\nexcept SystemExit as end: assert end.code == 0\n"
        f"print([m for m in {heavy!r} if m in sys.modules])"
    )
    out = python(code)
    assert "--dry-run" in out
    assert out.splitlines()[-1] == "[]"


@pytest.mark.parametrize("command", [["info"], ["info", "--check"], ["plot"]])
def test_file_commands_import_no_numba(tmp_path, command):
    path = tmp_path / "s.h5"
    fake.write(path, SMALL)
    code = (
        "import sys\nsys.stderr = sys.stdout\nfrom vibrodrive.cli import main\n"
        f"try: main({[*command, str(path)]!r})\nexcept SystemExit as end: assert end.code == 0, end.code\n"
        "print('numba' in sys.modules)"
    )
    assert python(code).splitlines()[-1] == "False"


def test_package_is_lazy_and_modules_hide_no_functions():
    code = (
        "import sys, vibrodrive as vd\nassert not {'numba', 'h5py', 'numpy'} & set(sys.modules)\n"
        "from vibrodrive.batch.sweep import compute\nassert callable(vd.sweep) and vd.sweep.__name__ == 'sweep'\n"
        "vd.ETA, vd.Status, vd.load, vd.simulate, vd.Scene, vd.Results\n"
        "assert all(dir(m) == sorted(m.__all__) for m in (vd, vd.plot, vd.errors))\n"
        "try: vd.nonsense\nexcept AttributeError as e: print(e)"
    )
    assert "nonsense" in python(code)


def test_sweep_writes_the_file_of_its_configuration(run, quick):
    code, out, err = run("sweep", "small.toml", "--set", "periods=4", "-o", "there.h5")
    assert (code, out) == (0, "")
    assert "80 points in" in err
    results = vd.load("there.h5")
    assert results.settings.periods == 4
    assert results.title == "Small"
    np.testing.assert_array_equal(
        results.section.reshape(80, 4, 2),
        fake.block(config.read("small.toml", ["periods=4"]).plan(), 0).section,
    )
    with h5py.File("there.h5") as file:
        assert file.attrs["config"] == SMALL
    assert sorted(p.name for p in Path().iterdir()) == ["small.toml", "there.h5"]


def test_finished_file_is_not_rewritten(run, quick):
    assert run("sweep", "small.toml")[0] == 0
    before = Path("small.h5").read_bytes()
    quick.clear()
    code, _, err = run("sweep", "small.toml")
    assert code == 0
    assert "small.h5 is complete: nothing to compute" in err
    assert quick == []
    assert Path("small.h5").read_bytes() == before
    assert run("sweep", "small.toml", "--overwrite")[0] == 0
    assert quick == [0]


def test_another_configuration_is_refused(run, quick):
    run("sweep", "small.toml")
    before = Path("small.h5").read_bytes()
    code, _, err = run("sweep", "small.toml", "--set", "B=0.2")
    assert code == 2
    assert err.count("\n") == 1
    assert "B is 0.1 in the file and 0.2 in the configuration" in err
    assert Path("small.h5").read_bytes() == before


def test_unusual_statuses_are_reported_with_advice(run, quick):
    _, _, err = run("sweep", "small.toml")
    assert f"points with the status BUDGET: 26; {vd.Status.BUDGET.advice}" in err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["sweep", "missing.toml"], ["missing.toml", "No such file"]),
        (["sweep"], ["CONFIG"]),
        (
            ["limits", "limits.toml"],
            ["command = 'limits': must be one of init, sweep, plot, info, trajectory, orbits, expl"],
        ),
        (["sweep", "small.toml", "--nonsense"], ["--nonsense"]),
        (["sweep", "small.toml", "--method", "newton"], ["--method", "newton", "certified"]),
        (["sweep", "small.toml", "--method", "fixed"], ["dtau", "missing"]),
        (["sweep", "small.toml", "--threads", "0"], ["--threads", "0"]),
        (["sweep", "small.toml", "--threads", "9999"], ["--threads = 9999", "<="]),
        (["sweep", "small.toml", "--set", "periods=0"], ["small.toml", "periods = 0", ">= 1"]),
        (["sweep", "small.toml", "--set", "colour=3"], ["key of --set = 'colour'", "must be one of A, B, eps, eta, "]),
        (
            ["sweep", "small.toml", "--set", "A.num=1000000", "--set", "periods=1000000"],
            ["TB", "free"],
        ),
        (["sweep", "small.toml", "-o", "."], ["-o", "directory"]),
        (["sweep", "small.toml", "--plot", "c1.jpg"], ["figure = 'c1.jpg'", ".png, .pdf, .svg"]),
        (["sweep", "--plot", "c1.jpg", "small.toml"], ["figure = 'c1.jpg'", ".png, .pdf, .svg"]),
        (["sweep", "small.toml", "other.toml", "--plot"], ["other.toml"]),
        (["sweep", "result.h5"], ["result.h5: must be a configuration", "`vibrodrive plot result.h5` draws it"]),
        (["sweep", "small.toml", "-o", ""], ["output = ''", "name"]),
        (["sweep", "small.toml", "-o", "a\nb.h5"], [r"output = 'a\nb.h5'", "control"]),
        (["sweep", "broken.toml"], ["broken.toml", "invalid TOML", "line 2"]),
        (["plot", "missing.h5"], ["missing.h5", "No such file"]),
        (["plot", "small.toml"], ["small.toml", "not a result file"]),
        (["info", "small.toml"], ["small.toml", "not a result file"]),
        (["info", "--check", "small.toml"], ["small.toml", "not a result file"]),
        (["trajectory", "small.toml"], ["sweep.A", "40 values", "one number"]),
        (["trajectory", "small.toml", *ONE, "-o", "t.doc"], ["--output = 't.doc'", ".csv", ".png, .pdf, .svg"]),
        (["trajectory", "small.toml", *ONE, "-o", "t.png", "-o", "u.svg"], ["'u.svg'", "at most one of each"]),
        (["orbits", "small.toml"], ["axes = A, eps", "A only, or A and B"]),
        (["orbits", "small.toml", "--set", "eps=0", "-o", "o.h5"], ["--output = 'o.h5'", "a table (.csv)"]),
        (["sweep", "small.toml", "--set", "record=limit"], ["eps", "left out, because its limit is computed"]),
        (["sweep", "small.toml", "--set", "record=failures"], ["method = 'certified'", 'with record = "failures"']),
        (["sweep", "small.toml", "--set", "record=motion"], ["record = 'motion'", "limit, failures"]),
        (["sweep", "limits.toml"], ["table = 'limits'", "must be one of"]),
        (["plot"], ["FILE..."]),
        (["plot", "limit.h5", "result.h5"], ["record = 'section'", '"limit"']),
        (["plot", "limit.h5", "other.h5"], ["axes = A", "the same values in all results"]),
        (["plot", "limit.h5", "other.h5", "--quantity", "k2"], ["--quantity = 'k2'", "left out for several files"]),
        (["plot", "limit.h5", "other.h5", "--over", "small.toml"], ["--over = 'small.toml'", "left out for several"]),
        (["plot", "map.h5", "--over", "small.toml"], ["small.toml", "not a result file"]),
        (["plot", "map.h5", "--over", "missing.csv"], ["missing.csv", "No such file"]),
        (["plot", "map.h5", "--over", "result.h5"], ["--over = 'result.h5'", 'record = "limit"', ".csv"]),
        (["plot", "limit.h5", "--over", "other.h5"], ["kind = 'bands'", "must be map"]),
        (["explore", "missing.toml", "--no-browser"], ["missing.toml", "No such file"]),
    ],
)
def test_bad_input_is_one_line_exit_2_and_no_file(run, quick, arguments, words):
    Path("broken.toml").write_text("[sweep]\nA = = 3\n")
    Path("limits.toml").write_text("[limits]\ncriterion = 'word'\n")
    fake.write("result.h5", SMALL)
    fake.write("limit.h5", LIMIT)
    fake.write("other.h5", LIMIT.replace("2.6", "2.7"))
    fake.write("map.h5", MAP)
    before = sorted(Path().rglob("*"))
    code, out, err = run(*arguments)
    assert code == 2
    assert out == ""
    assert err.startswith("vibrodrive: ")
    assert err.count("\n") == 1
    assert [w for w in words if w not in err] == []
    assert sorted(Path().rglob("*")) == before


def test_explore_names_its_extra_if_it_is_missing(run, monkeypatch):
    monkeypatch.setattr(import_module("vibrodrive.cli.explore"), "find_spec", lambda name: None)
    told = "vibrodrive: explore needs the extra `explore`: pip install 'vibrodrive[explore]'\n"
    assert run("explore", "--no-browser") == (2, "", told)


def test_info_reports_the_progress_of_a_sweep(run):
    plan = make_plan({"A": np.linspace(1, 2, 3000), "transient": 0, "periods": 1})
    fake.write("s.h5", plan, Origin("[sweep]\n", (), "Half a sweep"), [1])
    code, out, err = run("info", "s.h5")
    assert (code, err) == (0, "")
    for words in (
        "Half a sweep",
        "33.3 %",
        "1 of 3",
        "A = 1 to 2, 3000 values",
        "NOT_COMPUTED: 2000 points",
    ):
        assert words in out


def test_check_reports_a_sound_file_or_the_damaged_block(run, quick):
    run("sweep", "small.toml")
    code, out, err = run("info", "--check", "small.h5")
    assert (code, err) == (0, "complete and undamaged\n")
    assert "small.h5: Small" in out
    flip_bit("small.h5", "section_dxi", 100)
    code, _, err = run("info", "--check", "small.h5")
    assert code == 1
    assert "block 0 (points 0 to 79: A = 3 to 3.25, eps = 0 to 0.0002): section_dxi" in err
    code, _, err = run("sweep", "small.toml")
    assert code == 0
    assert "block 0 is damaged" in err
    assert run("info", "--check", "small.h5")[0] == 0


def test_info_writes_json(run, quick):
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
    assert run("info", "--check", "s.h5")[2] == "incomplete; the computed part is undamaged\n"
    with h5py.File("s.h5", "r+") as file:
        file["margin"][1500] = 7.0
    code, _, err = run("info", "--check", "s.h5")
    assert code == 1
    assert err.startswith("damaged: block 1 (points 1000 to 1999")


def test_plot_names_a_damaged_block_and_draws_the_rest(run, quick):
    Path("wide.toml").write_text(SMALL.replace("num = 40", "num = 3000"))
    run("sweep", "wide.toml")
    flip_bit("wide.h5", "section_dxi", 100, chunk=2)
    code, out, err = run("plot", "wide.h5")
    assert (code, out) == (1, "")
    assert "wide.png drawn" in err
    assert "wide.h5: damaged blocks are left out of section: block 2 (points 2000 to 2999: A = " in err
    assert Path("wide.png").read_bytes()[:4] == b"\x89PNG"


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


def test_check_compares_results_with_the_configuration(run):
    plan = make_plan({"A": 3.0, "transient": 0, "periods": 2})
    fake.write("s.h5", plan, "[sweep]\nA = 3.1\n[run]\ntransient = 0\nperiods = 2\n", [])
    code, _, err = run("info", "--check", "s.h5")
    assert code == 1
    assert "A is 3.0 in the file and 3.1 in the configuration" in err


def test_plot_draws_finished_and_unfinished_files(run, quick):
    run("sweep", "small.toml")
    code, _, err = run("plot", "small.h5")
    assert code == 0
    assert Path("small.png").read_bytes()[:4] == b"\x89PNG"
    assert "small.png drawn" in err
    plan = make_plan({"A": np.linspace(1, 2, 3000), "transient": 0, "periods": 1})
    fake.write("half.h5", plan, "[sweep]\n", [1])
    code, _, err = run("plot", "half.h5", "-o", "half.pdf", "--quantity", "xi", "--style", "print", "--width", "single")
    assert code == 0
    assert "33.3 % computed" in err
    assert Path("half.pdf").read_bytes()[:4] == b"%PDF"


def test_sweep_with_plot_draws_the_configured_figure(run, quick):
    Path("small.toml").write_text(SMALL + '[figure]\nkind = "poincare"\nquantity = "xi"\n')
    code, _, err = run("sweep", "--plot", "small.toml")
    assert (code, "figure.quantity = 'xi': must be left out for a figure of kind poincare" in err) == (2, True)
    assert not Path("small.h5").exists()
    Path("small.toml").write_text(SMALL + '[figure]\nkind = "poincare"\n')
    assert run("sweep", "--plot", "small.toml")[0] == 0
    assert Path("small.png").exists()
    for name, begins in (("mine.pdf", b"%PDF"), ("mine.SVG", b"<?xml")):
        assert run("sweep", "small.toml", "--plot", name)[0] == 0
        assert Path(name).read_bytes().startswith(begins)


def test_style_and_width_options_override_the_file(run, quick):
    Path("small.toml").write_text(SMALL + '[figure]\nkind = "poincare"\nstyle = "print"\nwidth = "single"\n')
    assert run("sweep", "small.toml")[0] == 0
    columns = {}
    for options in ((), ("--style", "screen"), ("--width", "double")):
        assert run("plot", "small.h5", "--dpi", "100", *options)[0] == 0
        drawn = image.imread("small.png")[..., :3]
        columns[options] = drawn.shape[1], bool(np.ptp(drawn, axis=-1).any())
    assert list(columns.values()) == [(331, False), (331, True), (685, False)]
    code, _, err = run("sweep", "small.toml", "--set", "figure.style=gaudy", "-o", "x.h5")
    assert code != 0
    assert "figure.style = 'gaudy': must be one of screen, print" in err


@pytest.mark.jit
def test_fast_checksum_equals_that_of_hdf5(tmp_path):
    """`fletcher32` returns the checksum that HDF5 computes and appends to a chunk."""
    from vibrodrive.jit.fletcher import fletcher32

    random = np.random.default_rng(2)
    samples = [random.random((7, n)) for n in (1, 63, 64, 65, 1000)]
    samples += [np.zeros((3, 50)), np.full((5, 100), np.nan)]
    samples += [np.full((rows, 10), -1).view(np.float64) for rows in (1, 50)]  # 80 and 4000 bytes, a block has 512
    with h5py.File(tmp_path / "x.h5", "w") as file:
        for k, values in enumerate(samples):
            data = file.create_dataset(str(k), data=values, chunks=values.shape, fletcher32=True)
            assert data.id.read_direct_chunk((0, 0))[1][-4:] == fletcher32(values).to_bytes(4, "little")


@pytest.mark.jit
def test_dry_run_writes_nothing_and_estimates_the_time(run):
    """tests/jobs/test_estimate.py compares the estimate with the real time."""
    options = ("--set", "A.num=200", "--set", "transient=600", "--set", "periods=600", "--threads", "1")
    run("sweep", "small.toml", "--set", "transient=1")  # compiles the kernels
    code, out, _ = run("sweep", "small.toml", "-o", "t.h5", "--dry-run", *options)
    assert code == 0
    assert not Path("t.h5").exists()
    words = dict(line.split(maxsplit=1) for line in out.splitlines())
    assert words["points"] == "400"
    assert words["periods"] == "4.8e+05 (1200 a point, 600 recorded)"
    run("sweep", "small.toml", "-o", "t.h5", *options)
    assert words["time"].endswith("to load the kernels")
    assert float(words["file"].split()[0]) == pytest.approx(Path("t.h5").stat().st_size / 1e6, rel=0.02)
    assert float(words["time"].split()[1]) > 0


@pytest.mark.jit
def test_dry_run_of_a_short_sweep_gives_a_time_and_memory_without_threads(run):
    said = [run("sweep", "small.toml", "--dry-run", *threads)[1] for threads in ((), ("--threads", "1"))]
    memory, time = ([line for out in said for line in out.splitlines() if key in line] for key in ("memory", "time"))
    assert memory[0] == memory[1]
    assert not any(line.split()[2].strip("0.") == "" for line in time)


@pytest.mark.jit
def test_trajectory_draws_one_motion_and_writes_its_switches(run):
    options = ("--set", "A=3.04", "--set", "eps=0", "--set", "transient=50")
    Path("small.png").write_text("the diagram of a sweep")
    code, out, err = run("trajectory", "small.toml", *options)
    assert code == 0
    assert out.splitlines()[3].startswith("period 2; impacts per excitation period: 0.5")
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


@pytest.mark.jit
def test_orbits_are_printed_drawn_and_written_and_drawn_over_a_map(run):
    axis, runs = "[sweep]\nA = {start = 2.59, stop = 2.62, num = 4}\n", "[run]\ntransient = 50\nperiods = 8\n"
    Path("o.toml").write_text(axis + runs + "[orbits]\nmax_period = 2\n")
    (bifurcation,) = vd.bifurcations((2.59, 2.62), max_period=2)
    code, out, err = run("orbits", "o.toml", "-o", "o.csv", "-o", "o.png")
    assert code == 0
    assert err.endswith("o.csv written\no.png drawn\no_multipliers.png drawn\n")
    line = out.splitlines()[1]
    assert float(line.split()[0]) == pytest.approx(bifurcation.A, abs=1e-13)
    assert "period doubling" in line
    assert "period 1 to 2" in line
    doubling = read_table(Path("o.csv"))[-1]
    assert (doubling["kind"], float(doubling["A"])) == ("period doubling", bifurcation.A)
    for path in ("o.png", "o_multipliers.png"):
        assert Path(path).read_bytes()[:4] == b"\x89PNG"
    over = ("--set", "B=[0.1, 0.11]", "--set", "A.stop=2.7", "--set", "max_period=1")
    assert run("orbits", "o.toml", "-o", "ab.csv", *over)[0] == 0
    assert [row["B"] for row in read_table(Path("ab.csv"))] == ["0.1", "0.11"]
    fake.write("map.h5", MAP)
    assert run("plot", "map.h5", "-o", "plain.png")[0] == 0
    assert run("plot", "map.h5", "--over", "ab.csv", "-o", "over.png") == (0, "", "over.png drawn\n")
    assert Path("over.png").read_bytes() != Path("plain.png").read_bytes()


@pytest.mark.jit
@pytest.mark.slow("8 s: limits and failures of a few points")
def test_limits_and_failures_are_sweeps(run):
    """They are computed, resumed, checked, described and drawn; limits in several files are drawn together."""
    Path("l.toml").write_text(LIMIT.replace("periods", "transient = 60\nperiods"))
    Path("f.toml").write_text(FAILURES)
    for call in (("l.toml",), ("l.toml", "--method", "fixed", "-o", "grid.h5"), ("f.toml",)):
        code, out, err = run("sweep", *call, "--plot")
        assert code == 0, err
        assert run("sweep", *call)[2].endswith("is complete: nothing to compute\n")
        assert "unknown" in run("sweep", *call, "-o", "new.h5", "--dry-run")[1].splitlines()[-1]
    limits, found = vd.load("l.h5"), vd.limit(2.5, transient=60, periods=60)
    assert limits.k2[0] == found.k2
    assert (vd.load("f.h5").judged > 0).all()
    code, out, err = run("plot", "l.h5", "grid.h5", "-o", "both.png")
    assert (code, out, err) == (0, "", "both.png drawn\n")
    assert len({Path(name).read_bytes() for name in ("l.png", "grid.png", "both.png")}) == 3
    for name, record, array in (("l.h5", "limit", "k2"), ("f.h5", "failures", "judged")):
        assert json.loads(run("info", name, "--check", "--json")[1])["settings"]["record"] == record
        flip_bit(name, array, 2)
        code, _, err = run("info", "--check", name)
        assert (code, f": {array}" in err) == (1, True)
    code, _, err = run("sweep", "l.toml")
    assert (code, "block 0 is damaged" in err) == (0, True)
    assert vd.load("l.h5").k2.tolist() == limits.k2.tolist()


class Stream(io.StringIO):
    def __init__(self, terminal):
        super().__init__()
        self.isatty = lambda: terminal


def test_progress_rewrites_its_line_on_a_terminal():
    stream = Stream(terminal=True)
    show = Show(stream, "s.h5")
    show.update(lambda: "1 %")
    show.update(lambda: "2 %")
    show.say("done")
    assert stream.getvalue() == "\r\x1b[Ks.h5  1 %\r\x1b[Ks.h5  2 %\r\x1b[Kdone\n"


def test_progress_prints_occasional_lines_without_a_terminal(monkeypatch):
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
    tally.start(points=1000, done=400, periods=50)
    assert tally.line() == " 40.0 %"
    monkeypatch.setattr("time.monotonic", lambda: 110.0)
    tally.add(200)
    assert tally.line() == " 60.0 %  1.00e+03 periods/s  20 points/s  20.0 s left"


def test_closed_terminal_does_not_stop_progress():
    stream = Stream(terminal=True)
    show = Show(stream, "s.h5")
    stream.close()
    show.update(lambda: "1 %")
    show.say("done")


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (0.00412, "4.1 ms"),
        (0.314, "0.31 s"),
        (3.21, "3.2 s"),
        (59.97, "1 min 0 s"),
        (250, "4 min 10 s"),
        (7500, "2 h 5 min"),
        (3.2 * 86400, "3 d 4 h"),
    ],
)
def test_durations_are_readable(seconds, words):
    assert duration(seconds) == words


def test_lack_of_memory_prints_one_line(run, monkeypatch):
    def fails(*_):
        raise MemoryError("Unable to allocate 1.19 GiB for an array")

    monkeypatch.setattr("vibrodrive.model.config.read", fails)
    Path("c.toml").touch()
    assert run("sweep", "c.toml") == (1, "", "vibrodrive: Unable to allocate 1.19 GiB for an array\n")


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


@pytest.mark.skipif(os.name != "posix", reason="signals")
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


@pytest.mark.skipif(os.name != "posix", reason="streams of a shell")
def test_neither_a_closed_stream_nor_the_backend_of_a_display_stops_a_command(tmp_path):
    fake.write(tmp_path / "small.h5", SMALL)
    command = f'exec "{sys.executable}" -m vibrodrive plot small.h5 2>&-'
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2]), "MPLBACKEND": "nonsense"}
    done = subprocess.run(["sh", "-c", command], cwd=tmp_path, env=environment, timeout=1200, check=False)
    assert done.returncode == 0
    assert (tmp_path / "small.png").stat().st_size > 0


def test_moving_the_file_ends_a_sweep(run, quick, monkeypatch):
    def blocks(plan, which=None, **options):
        for block in fake.run_blocks(plan, which):
            yield block
            if Path("small.h5").exists():
                os.rename("small.h5", "elsewhere.h5")

    monkeypatch.setattr(import_module("vibrodrive.batch.sweep"), "run_blocks", blocks)
    # so that the block is written at the end of the sweep, after the rename
    monkeypatch.setattr(import_module("vibrodrive.store.writer"), "GROUP_SECONDS", np.inf)
    code, _, err = run("sweep", "small.toml")
    assert (code, err.splitlines()[-1]) == (1, "vibrodrive: small.h5: moved or deleted while it was written")


IDLE = "[sweep]\nA = 3.04\n[switching]\ndtau = 0.1\n[run]\ntransient = 1\nperiods = 1\n"


def test_unused_parameters_are_refused_as_in_python(run, quick):
    Path("idle.toml").write_text(IDLE)
    told = "must be left out with method = 'certified', because it is used by"
    for more, name in (
        ((), "dtau = 0.1"),
        (("--set", "dtau=[0.1, 0.01]"), "dtau = [0.1, 0.01]"),
        (("--set", "tol=1e-7", "--method", "certified"), "tol = 1e-07"),
    ):
        for command in ("sweep", "trajectory"):
            code, out, err = run(command, "idle.toml", *more)
            assert (code, out, err.count("\n")) == (2, "", 1)
            assert f"{name}: {told}" in err
    err = run("sweep", "idle.toml", "--set", "tol=1e-9", "--set", "method=fixed")[2]
    assert "tol = 1e-09: must be left out with method = 'fixed'" in err


def test_option_for_the_method_leaves_out_what_it_does_not_use(run, quick):
    Path("idle.toml").write_text(IDLE.replace("dtau", 'method = "muller"\ntol = 1e-9\ndtau'))
    for method, used in (("certified", set()), ("fixed", {"dtau"}), ("muller", {"dtau", "tol"})):
        for option in (("--method", method), ("--set", f"method={method}")):
            assert run("sweep", "idle.toml", "--overwrite", *option)[0] == 0
            out = run("info", "idle.h5")[1]
            assert {name for name in ("dtau", "tol") if f"{name} =" in out} == used
            assert run("sweep", "idle.toml", *option)[2].startswith("idle.h5 is complete")


def test_table_that_a_command_does_not_read_is_named_in_one_line(run, quick):
    Path("small.toml").write_text(SMALL + '[orbits]\nmax_period = 2\n[trajectory]\nperiods = 3\n[figure]\nx = "A"\n')
    _, _, err = run("sweep", "small.toml")
    told = "warning: [trajectory] is not read by `vibrodrive sweep`; [orbits] is not read by `vibrodrive sweep`\n"
    assert [line for line in err.splitlines(keepends=True) if "not read" in line] == [told]
    Path("small.toml").write_text(SMALL)
    _, _, err = run("sweep", "small.toml", "--overwrite", "--set", "max_period=2")
    assert "warning: [orbits] is not read by `vibrodrive sweep`\n" in err


@pytest.mark.jit
def test_commands_name_a_slip_of_all_points_once(run):
    scene = "[physical]\na0 = 0.8\nomega0 = 150\nmu = 0.6\nalpha = 3.4\n[run]\ntransient = 0\nperiods = 1\n"
    Path("mm.toml").write_text(scene)
    options = {"all": [], "some": ["--set", "a0=[0.8e-3, 0.8]"], "none": ["--set", "a0=0.8e-3"]}
    for name, more in options.items():
        code, _, err = run("sweep", "mm.toml", "-o", f"{name}.h5", *more)
        assert code == 0
        assert err.count("not in SI units") == (name == "all")
