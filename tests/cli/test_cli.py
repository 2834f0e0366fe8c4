"""Commands have the documented exit codes and output, give one line for each error, and import only what they need."""

import io
import json
import os
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
from vibrodrive.cli.common import judge_idle
from vibrodrive.jobs import limits
from vibrodrive.jobs.progress import Show, Tally, duration
from vibrodrive.model import config
from vibrodrive.model.config import parse
from vibrodrive.model.plan import make_plan
from vibrodrive.stability.limit import Limit
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


@pytest.fixture
def run(run):
    """Return the fixture `run` of conftest.py, in a directory with the configuration SMALL."""
    Path("small.toml").write_text(SMALL)
    return run


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


@pytest.mark.parametrize("command", ["info", "plot", "verify"])
def test_file_commands_import_no_numba(tmp_path, command):
    path = tmp_path / "s.h5"
    fake.write(path, SMALL)
    code = (
        "import sys\nsys.stderr = sys.stdout\nfrom vibrodrive.cli import main\n"
        f"try: main([{command!r}, {str(path)!r}])\nexcept SystemExit as end: assert end.code == 0, end.code\n"
        "print('numba' in sys.modules)"
    )
    assert python(code).splitlines()[-1] == "False"


def test_package_is_lazy_and_modules_hide_no_functions():
    code = (
        "import sys, vibrodrive as vd\nassert not {'numba', 'h5py', 'numpy'} & set(sys.modules)\n"
        "from vibrodrive.batch.sweep import compute\nassert callable(vd.sweep) and vd.sweep.__name__ == 'sweep'\n"
        "vd.ETA, vd.Status, vd.load, vd.simulate, vd.Scene, vd.Results\n"
        "assert set(vd.__all__) <= set(dir(vd))\n"
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
        (["swep"], ["swep"]),
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
        (["sweep", "small.toml", "-o", ""], ["output = ''", "name"]),
        (["sweep", "small.toml", "-o", "a\nb.h5"], [r"output = 'a\nb.h5'", "control"]),
        (["validate", "-o", ""], ["output = ''", "name"]),
        (["sweep", "broken.toml"], ["broken.toml", "invalid TOML", "line 2"]),
        (["plot", "missing.h5"], ["missing.h5", "No such file"]),
        (["plot", "small.toml"], ["small.toml", "not a result file"]),
        (["info", "small.toml"], ["small.toml", "not a result file"]),
        (["verify", "small.toml"], ["small.toml", "not a result file"]),
        (["trajectory", "small.toml"], ["sweep.A", "40 values", "one number"]),
        (["trajectory", "small.toml", "--set", "A=3", "--set", "eps=0", "-o", "t.doc"], ["t.doc", ".png"]),
        (["limits", "small.toml"], ["axes = A, eps", "one or two of A, B and eta"]),
        (["limits", "small.toml", "--set", "criterion=3"], ["limits.criterion = 3", "string"]),
        (["limits", "small.toml", "--set", "eps=0", "--threads", "9999"], ["threads = 9999"]),
        (["orbits", "small.toml"], ["axes = A, eps", "A only, or A and B"]),
        (["orbits", "small.toml", "--set", "eps=0", "--set", "B=[0.1, 0.1]"], ["B = [0.1, 0.1]", "two different"]),
        (["failures", "small.toml"], ["eps = 0.0", "> 0"]),
        (["paper", "--only", "fig99"], ["figure = 'fig99'", "fig02"]),
        (["paper", "-o", "small.toml"], ["-o", "small.toml"]),
        (["driver", "small.toml"], ["sweep.A", "40 values", "one number"]),
        (["driver", "small.toml", "--set", "A=3", "--set", "eps=0"], ["physical.a0 is missing", "omega0"]),
    ],
)
def test_bad_input_is_one_line_exit_2_and_no_file(run, quick, arguments, words):
    Path("broken.toml").write_text("[sweep]\nA = = 3\n")
    before = sorted(Path().rglob("*"))
    code, out, err = run(*arguments)
    assert code == 2
    assert out == ""
    assert err.startswith("vibrodrive: ")
    assert err.count("\n") == 1
    assert [w for w in words if w not in err] == []
    assert sorted(Path().rglob("*")) == before


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


def test_verify_reports_a_sound_file_or_the_damaged_block(run, quick):
    run("sweep", "small.toml")
    code, out, err = run("verify", "small.h5")
    assert (code, err) == (0, "")
    assert "complete and undamaged" in out
    with h5py.File("small.h5") as file:
        chunk = file["section_dxi"].id.get_chunk_info(0)
    raw = bytearray(Path("small.h5").read_bytes())
    raw[chunk.byte_offset + 100] ^= 4
    Path("small.h5").write_bytes(raw)
    code, _, err = run("verify", "small.h5")
    assert code == 1
    assert "block 0 (points 0 to 79: A = 3 to 3.25, eps = 0 to 0.0002): section_dxi" in err
    code, _, err = run("sweep", "small.toml")
    assert code == 0
    assert "block 0 is damaged" in err
    assert run("verify", "small.h5")[0] == 0


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
    assert run("verify", "s.h5")[1].splitlines()[-1] == "incomplete; the computed part is undamaged"
    with h5py.File("s.h5", "r+") as file:
        file["margin"][1500] = 7.0
    code, _, err = run("verify", "s.h5")
    assert code == 1
    assert err.startswith("damaged: block 1 (points 1000 to 1999")


def test_plot_names_a_damaged_block_and_draws_the_rest(run, quick):
    Path("wide.toml").write_text(SMALL.replace("num = 40", "num = 3000"))
    run("sweep", "wide.toml")
    with h5py.File("wide.h5") as file:
        chunk = file["section_dxi"].id.get_chunk_info(2)
    raw = bytearray(Path("wide.h5").read_bytes())
    raw[chunk.byte_offset + 100] ^= 4
    Path("wide.h5").write_bytes(raw)
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
    before = Path("fig07.toml").read_text()
    for arguments in (("fig07",), ("fig08", "-o", "fig07.toml")):
        code, _, err = run("init", *arguments)
        assert (code, err) == (2, "vibrodrive: output = 'fig07.toml': must be a new file, because this file exists\n")
    assert Path("fig07.toml").read_text() == before
    for arguments, word in ((("nothing",), "quickstart"), (("-o", "x.toml"), "output = 'x.toml'")):
        code, _, err = run("init", *arguments)
        assert code == 2
        assert word in err


def test_verify_compares_results_with_the_configuration(run):
    plan = make_plan({"A": 3.0, "transient": 0, "periods": 2})
    fake.write("s.h5", plan, "[sweep]\nA = 3.1\n[run]\ntransient = 0\nperiods = 2\n", [])
    code, _, err = run("verify", "s.h5")
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
def test_trajectory_draws_one_motion(run):
    options = ("--set", "A=3.04", "--set", "eps=0", "--set", "transient=50")
    Path("small.png").write_text("the diagram of a sweep")
    code, out, err = run("trajectory", "small.toml", *options)
    assert code == 0
    assert out.splitlines()[3].startswith("period 2; impacts per excitation period: 0.5")
    assert Path("small_trajectory.png").read_bytes()[:4] == b"\x89PNG"
    assert Path("small.png").read_text() == "the diagram of a sweep"
    assert "switches" in err


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


def test_deleting_the_file_ends_limits(run, monkeypatch):
    def found(quantity, arguments, disturbance, method, *rest):
        yield 0, Limit(2.5, 0.1, 101.0, disturbance, method, "impacts", k2=1e-3)
        Path("limits.h5").unlink()
        yield 1, Limit(2.5, 0.2, 101.0, disturbance, method, "impacts", k2=1e-3)

    monkeypatch.setattr(limits, "each_of", found)
    code, _, err = run(
        "limits", "small.toml", "-o", "limits.h5", "--set", "A=2.5", "--set", "B=[0.1, 0.2]", "--set", "eps=0"
    )
    assert (code, err) == (1, "vibrodrive: limits.h5: moved or deleted while it was written\n")


@pytest.mark.jit
def test_paper_draws_selected_figures_and_judges_their_claims(run):
    code, out, err = run("paper", "--only", "fig02", "--only", "fig04", "-o", "there")
    assert (code, out) == (0, ""), err
    names = {p.name for p in Path("there").iterdir()}
    assert {"fig02.png", "fig02.pdf", "fig04.png", "fig04.pdf", "claims.json", "claims.md"} <= names
    claims = json.loads(Path("there/claims.json").read_text())["claims"]
    assert claims
    assert {c["figure"] for c in claims} <= {"fig02", "fig04"}
    assert f"Number of claims: {len(claims)} (" in err
    assert f"there: {len(names)} files written" in err


IDLE = "[sweep]\nA = 3.04\n[switching]\ndtau = 0.1\ntol = 1e-9\n[run]\ntransient = 1\nperiods = 1\n"


@pytest.mark.jit
def test_unused_settings_are_named_or_refused(run):
    Path("idle.toml").write_text(IDLE)
    code, out, err = run("sweep", "idle.toml", "--dry-run", "--set", "dtau=[0.1, 0.01]")
    assert (code, out) == (2, "")
    assert (
        "dtau = [0.1, 0.01]: must be left out with method = 'certified', because it is used by fixed and muller only"
        in err
    )
    for method, names in (("certified", ["dtau", "tol"]), ("fixed", ["tol"]), ("muller", [])):
        code, _, err = run("sweep", "idle.toml", "--method", method, "-o", f"{method}.h5")
        assert code == 0
        assert [line.split()[0] for line in err.splitlines() if "is ignored" in line] == names
    out = run("info", "certified.h5")[1]
    assert not any(f"{name} =" in out for name in ("dtau", "tol", "eta"))
    out = run("info", "muller.h5")[1]
    assert "tol = 1e-09" in out
    assert "eta =" not in out


def test_unused_default_settings_are_not_named(capsys):
    """The explorer writes configurations with every key. A key with its default value gives no note."""
    judge_idle(parse(IDLE.replace("dtau = 0.1\ntol = 1e-9", "tol = 1e-7")))
    assert capsys.readouterr().err == ""
    judge_idle(parse(IDLE))
    assert capsys.readouterr().err.count("is ignored") == 2


@pytest.mark.jit
def test_commands_name_a_slip_of_all_points_once(run):
    scene = "[physical]\na0 = 0.8\nomega0 = 150\nmu = 0.6\nalpha = 3.4\n[run]\ntransient = 0\nperiods = 1\n"
    Path("mm.toml").write_text(scene)
    options = {"all": [], "some": ["--set", "a0=[0.8e-3, 0.8]"], "none": ["--set", "a0=0.8e-3"]}
    for name, more in options.items():
        code, _, err = run("sweep", "mm.toml", "-o", f"{name}.h5", *more)
        assert code == 0
        assert err.count("not in SI units") == (name == "all")
