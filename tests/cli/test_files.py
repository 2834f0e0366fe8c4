"""Result files of each kind are not replaced by mistake and describe their contents. Unusable files are refused."""

import json
import os
import resource
import signal
from contextlib import redirect_stdout
from importlib import import_module
from io import StringIO
from pathlib import Path

import h5py
import numpy as np
import pytest

import vibrodrive as vd
from tests.support import fake
from vibrodrive import cli
from vibrodrive.cli.files import read_in_process
from vibrodrive.errors import Damaged, NoResult
from vibrodrive.figures import diagrams as figures
from vibrodrive.figures.failures import failures_figure
from vibrodrive.figures.orbits import multiplier_diagram
from vibrodrive.figures.style import save
from vibrodrive.jobs import sweep as runner
from vibrodrive.model import config
from vibrodrive.model.kinds import FILES
from vibrodrive.model.results import Results
from vibrodrive.store.file import new_file
from vibrodrive.store.header import read_kind
from vibrodrive.store.layout import Origin, digest
from vibrodrive.store.writer import open_writer

CONFIGS = {
    "sweep": "[sweep]\nA = {start = 3.0, stop = 3.25, num = 40}\neps = [0, 2e-4]\n[run]\ntransient = 0\nperiods = 6\n",
    "limits": 'title = "A limit"\n[sweep]\nA = [2.5]\n[run]\ntransient = 60\nperiods = 60\n'
    '[limits]\ncriterion = "word"\n',
    "orbits": "[sweep]\nA = {start = 2.59, stop = 2.62, num = 4}\n[run]\ntransient = 50\nperiods = 8\n"
    "section_phase = 2.0\n[orbits]\nmax_period = 2\n",
    "failures": "[sweep]\nA = [1.5, 3.04]\ndtau = [0.01, 0.1]\n[model]\neps = 2e-4\n"
    "[run]\ntransient = 20\nperiods = 40\n",
}
"""A small configuration for each command that writes a result file."""

COMMANDS = [*CONFIGS]


@pytest.fixture
def run(run):
    """Return the fixture `run` of conftest.py, in a directory with the configurations CONFIGS."""
    for name, text in CONFIGS.items():
        Path(f"{name}.toml").write_text(text)
    return run


@pytest.fixture
def idle(monkeypatch):
    """Let the test fail if a command begins a computation."""

    def begun(*arguments, **options):
        raise AssertionError("something is computed")

    def each(*arguments, **options):
        """Replace `each_of`, a generator, which computes limits only when a value is requested."""
        yield begun()

    for name in (
        "batch.sweep.run_blocks", "jobs.limits.each_of", "jobs.orbits.family", "jobs.failures.failures_of_methods",
    ):  # fmt: skip
        module, _, function = name.rpartition(".")
        monkeypatch.setattr(import_module(f"vibrodrive.{module}"), function, each if function == "each_of" else begun)


def a_sweep(path, blocks=None, text=CONFIGS["sweep"]):
    """Write a file of a sweep, with simulated blocks."""
    fake.write(path, text, which=blocks)
    return Path(path)


def foreign(path):
    """Write an HDF5 file of another program that contains some of the names in files of this program."""
    with h5py.File(path, "w") as file:
        file["A"] = np.arange(3.0)
        file["section_xi"] = np.arange(6.0)
        file.attrs["title"] = "precious"


def contents():
    """Return the contents of all files of the directory, and the targets of links."""
    there = {}
    for p in Path().iterdir():
        there[p.name] = os.readlink(p) if p.is_symlink() else p.read_bytes() if p.is_file() else p.stat().st_mode
    return there


def assert_refused(run, *arguments, words=()):
    before = contents()
    code, out, err = run(*arguments)
    assert (code, out) == (2, ""), err
    assert err.startswith("vibrodrive: ")
    assert err.count("\n") == 1
    assert [w for w in words if w not in err] == [], err
    assert contents() == before


# one file as input and output, under two names


@pytest.mark.parametrize("command", COMMANDS)
def test_commands_check_their_output(run, idle, command):
    """Each command calls the check of its output. tests/store/test_place.py tests this check."""
    Path("link.h5").symlink_to(f"{command}.toml")
    foreign("foreign.h5")
    os.mkfifo("pipe.h5")
    call = (command, f"{command}.toml", "-o")
    for options in ((), ("--overwrite",)):
        assert_refused(run, *call, "link.h5", *options, words=["output", "another file", f"{command}.toml"])
        assert_refused(run, *call, "foreign.h5", *options, words=["foreign.h5", "only result files"])
    assert_refused(run, command, "pipe.h5", words=["pipe.h5", "a named pipe"])


@pytest.mark.parametrize(
    ("command", "config_name", "options"),
    [
        ("sweep", "c.png", ("--plot",)),
        ("limits", "c.png", ()),
        ("orbits", "c_multipliers.png", ("-o", "c.h5")),
        ("limits", "c.png.part", ("-o", "c.h5")),
        ("trajectory", "c.png", ("--set", "A=3", "--set", "eps=0", "-o", "c.png")),
        ("trajectory", "c.toml", ("--set", "A=3", "--set", "eps=0", "-o", "link.svg")),
    ],
)
def test_figure_never_replaces_the_configuration(run, idle, command, config_name, options):
    Path(config_name).write_text(CONFIGS.get(command, CONFIGS["sweep"]))
    Path("link.svg").symlink_to(config_name)
    assert_refused(run, command, config_name, *options, words=["figure", "another file", config_name])


def test_figure_never_replaces_a_result(run, idle):
    a_sweep("s.h5")
    a_sweep("y.h5").rename("y.png")
    Path("s.png").symlink_to("s.h5")
    os.link("s.h5", "s.pdf")
    assert_refused(run, "plot", "y.png", words=["figure", "y.png", "another file"])
    assert_refused(run, "plot", "s.h5", words=["s.png", "another file"])
    assert_refused(run, "plot", "s.h5", "-o", "s.pdf", words=["s.pdf", "another file"])
    assert_refused(run, "plot", "s.h5", "-o", "y.png", words=["y.png", "contains data"])
    assert_refused(run, "sweep", "sweep.toml", "-o", "s.h5", "--plot", words=["s.png", "another file"])


def test_paper_never_replaces_a_foreign_file(run):
    call = ("paper", "--only", "fig02", "-o", "out")
    Path("out").mkdir()
    foreign("out/fig07.h5")
    before = Path("out/fig07.h5").read_bytes()
    code, _, err = run(*call)
    assert (code, err.count("\n")) == (2, 1)
    assert "fig07.h5" in err
    assert Path("out/fig07.h5").read_bytes() == before
    assert [p.name for p in Path("out").iterdir()] == ["fig07.h5"]


def test_overwrite_replaces_an_unreadable_result(tmp_path):
    path = a_sweep(tmp_path / "s.h5")
    raw = path.read_bytes()
    path.write_bytes(raw[: len(raw) // 2])
    with pytest.raises(Damaged, match="--overwrite"):
        read_kind(path)
    text = CONFIGS["sweep"]
    open_writer(path, config.parse(text).plan(), Origin(text), overwrite=True).close()
    assert read_kind(path) == "sweep"


# kinds of result files


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Return a directory with a file of every kind and its figures, made by the commands."""
    folder = tmp_path_factory.mktemp("kinds")
    a_sweep(folder / "sweep.h5")
    for command in ("limits", "orbits", "failures"):
        config = folder / f"{command}.toml"
        config.write_text(CONFIGS[command])
        with redirect_stdout(StringIO()) as out, pytest.raises(SystemExit) as end:
            cli.main([command, str(config), "-o", str(folder / f"{command}.h5")])
        assert not end.value.code
        (folder / f"{command}.txt").write_text(out.getvalue())
    return folder


@pytest.fixture
def copied(run, made):
    """Return the fixture `run`, in a directory with copies of the files of `made`."""
    for path in made.glob("*.h5"):
        Path(path.name).write_bytes(path.read_bytes())
    return run


@pytest.mark.jit
@pytest.mark.parametrize("command", COMMANDS)
def test_every_kind_of_file_is_named_described_checked_and_drawn(copied, made, command):
    path = Path(f"{command}.h5")
    assert read_kind(path) == command
    code, out, err = copied("info", str(path))
    assert (code, err) == (0, "")
    assert [w for w in (f"(vibrodrive {command})", "100.0 %", "A = ") if w not in out] == []
    code, out, err = copied("verify", str(path))
    assert (code, err) == (0, "")
    assert "complete and undamaged" in out
    code, out, err = copied("plot", str(path), "-o", "figure.png")
    assert code == 0, err
    drawn = Path("figure.png").read_bytes()
    assert drawn[:4] == b"\x89PNG"
    if command != "sweep":
        assert drawn == (made / f"{command}.png").read_bytes()
    told = json.loads(copied("info", str(path), "--json")[1])
    assert (told["file"], told["kind"], told["computed"]) == (str(path), command, 1.0)
    assert told["axes"]["A"]["num"] >= 1
    assert told["parameters"]["B"] == 0.1
    assert told["versions"]["vibrodrive"] == vd.__version__
    assert told["bytes"] == path.stat().st_size


@pytest.mark.jit
def test_tables_and_files_equal_the_results_of_functions(made):
    one = vd.limit(2.5, "eps", criterion="word", transient=60, periods=60)
    found = vd.load(made / "limits.h5", kind="limits")
    assert (found.title, found.criterion, found.numbers["k2"][0, 0]) == ("A limit", "word", one.k2)
    line = (made / "limits.txt").read_text().splitlines()[1].split()
    assert line[:4] == ["2.5", "1", f"{one.k2:.4g}", f"{one.velocity:.4g}"]
    (bifurcation,) = vd.bifurcations((2.59, 2.62), max_period=2)
    line = (made / "orbits.txt").read_text().splitlines()[1]
    assert float(line.split()[0]) == pytest.approx(bifurcation.A, abs=1e-13)
    assert "period doubling" in line
    assert "period 1 to 2" in line
    assert {path.suffix for path in made.iterdir()} == {".h5", ".png", ".toml", ".txt"}


@pytest.mark.jit
def test_loaded_results_are_drawn_as_by_the_command(copied, made):
    figures = {
        "failures": failures_figure(vd.load("failures.h5")),
        "orbits_multipliers": multiplier_diagram(vd.load("orbits.h5", kind="orbits").family),
    }
    for name, figure in figures.items():
        save(figure, Path(f"{name}.png"))
        assert Path(f"{name}.png").read_bytes() == (made / f"{name}.png").read_bytes()
    assert copied("plot", "orbits.h5", "--kind", "multipliers")[0] == 0
    assert Path("orbits.png").read_bytes() == (made / "orbits_multipliers.png").read_bytes()


@pytest.mark.jit
def test_existing_files_are_listed_as_text_and_json(copied, idle, made):
    assert copied("orbits", "orbits.toml")[1] == (made / "orbits.txt").read_text()
    told = json.loads(copied("orbits", "orbits.toml", "--json")[1])
    family = vd.load("orbits.h5", kind="orbits").family
    assert [b["A"] for b in told["bifurcations"]] == [b.A for b in family.bifurcations]
    assert [b["kind"] for b in told["bifurcations"]] == [b.kind for b in family.bifurcations]
    assert sum(told["orbits"].values()) == sum(map(len, family.orbits))
    code, out, err = copied("atlas", "failures.toml", "--json")  # the former name of failures
    assert code == 0, err
    assert json.loads(out)["axes"]["A"]["num"] == 2


@pytest.mark.jit
def test_options_of_other_kinds_are_refused(copied):
    assert_refused(copied, "plot", "limits.h5", "--quantity", "xi", words=["--quantity", "limits of stability"])
    assert_refused(copied, "plot", "failures.h5", "--kind", "bifurcation", words=["--kind", "failures"])
    assert_refused(copied, "plot", "orbits.h5", "--kind", "poincare", words=["--kind", "multipliers"])


@pytest.mark.jit
def test_file_of_another_kind_is_refused(copied):
    for command, other in (("sweep", "limits"), ("limits", "orbits")):
        words = [f"{other}.h5", FILES[command].holds, FILES[other].holds, "choose another file with -o"]
        assert_refused(copied, command, f"{command}.toml", "-o", f"{other}.h5", words=words)


@pytest.mark.jit
@pytest.mark.parametrize(
    ("command", "told"), [("limits", "criterion=impacts"), ("orbits", "max_period=1"), ("failures", "periods=41")]
)
def test_complete_file_is_neither_recomputed_nor_replaced(copied, monkeypatch, made, command, told):
    """A run of the same configuration computes nothing. A run of another configuration is refused.

    The message names the differences.
    """

    def begun(*arguments, **options):
        raise AssertionError("something is computed")

    for name in ("stability.limit.search_band", "jobs.orbits.family", "jobs.failures.failures_of_methods"):
        module, _, function = name.rpartition(".")
        monkeypatch.setattr(import_module(f"vibrodrive.{module}"), function, begun)
    path, figure = Path(f"{command}.h5"), Path(f"{command}.png")
    # a comment, or a key with its default value, does not make the configuration different
    Path(f"{command}.toml").write_text("# a remark\n" + CONFIGS[command])
    code, _, err = copied(command, f"{command}.toml", "--set", "B=0.1")
    assert code == 0, err
    assert "is complete: nothing to compute" in err
    assert path.read_bytes() == (made / path).read_bytes()
    assert figure.read_bytes() == (made / figure).read_bytes()
    for option in ("B=0.2", "transient=21", told):
        name = option.split("=")[0]
        words = ["another configuration", f"{name} is ", " in the file and ", "--overwrite"]
        assert_refused(copied, command, f"{command}.toml", "--set", option, words=words)
    with pytest.raises(AssertionError, match="something is computed"):
        cli.cli.main([command, f"{command}.toml", "--overwrite"], standalone_mode=False)


@pytest.mark.jit
def test_default_periods_of_limits_differ_from_those_of_a_sweep(copied, idle):
    """A failure map has 1500 periods by default, because it contains limits; a sweep has 250."""
    with h5py.File("failures.h5", "r+") as file:
        file.attrs["config"] = CONFIGS["failures"].replace("periods = 40", "")
        file.attrs["config_sha256"] = digest(file.attrs["config"])
        file.attrs["periods"] = 1500
    words = ["periods is 1500 in the file and 250 in the configuration"]
    assert_refused(copied, "failures", "failures.toml", "--set", "periods=250", words=words)


@pytest.mark.jit
@pytest.mark.parametrize("command", ["orbits", "failures"])
def test_damaged_file_is_not_complete(copied, idle, command):
    with h5py.File(f"{command}.h5", "r+") as file:
        file["A"][0] = 7.0
    code, out, err = copied(command, f"{command}.toml")
    assert (code, out) == (1, "")
    assert [w for w in ("damaged", "--overwrite") if w not in err] == []


@pytest.mark.jit
@pytest.mark.parametrize(
    ("command", "name"),
    [("limits", "k2"), ("limits", "A"), ("limits", "how"), ("failures", "judged"), ("orbits", "phase")],
)
def test_verify_finds_a_flipped_bit_in_any_kind(copied, command, name):
    path = Path(f"{command}.h5")
    with h5py.File(path) as file:
        data = file[name].id
        offset = data.get_offset() if data.get_offset() is not None else data.get_chunk_info(0).byte_offset
    raw = bytearray(path.read_bytes())
    raw[offset + 2] ^= 16
    path.write_bytes(raw)
    code, out, err = copied("verify", str(path))
    assert code == 1
    assert "undamaged" not in out
    assert f"{name}: wrong checksum" in err


@pytest.mark.jit
def test_verify_finds_a_changed_word(copied):
    """HDF5 has no checksums for texts of variable length. Therefore the file has a checksum of all its contents."""
    path = Path("orbits.h5")
    path.write_bytes(path.read_bytes().replace(b"UP DOWN IMPACT", b"UP DOWM IMPACT"))
    code, _, err = copied("verify", str(path))
    assert (code, err) == (1, "damaged: the SHA-256 of the contents differs from the stored SHA-256\n")


def test_kind_of_a_later_version_is_named(tmp_path):
    path = a_sweep(tmp_path / "s.h5")
    with h5py.File(path, "r+") as file:
        file.attrs["kind"] = "basins"
    for read in (vd.load, read_kind):
        with pytest.raises(NoResult, match="kind = 'basins': must be one of sweep, limits"):
            read(path)


# symbolic links to themselves, pipes, a full disk


def test_loops_and_pipes_are_refused_by_readers_and_figures(run, idle):
    a_sweep("s.h5")
    for name in ("loop.h5", "loop.png", "loop.toml", "loop"):
        Path(name).symlink_to(name)
    os.mkfifo("pipe.h5")
    os.mkfifo("pipe.png")
    for arguments in (
        ("sweep", "loop.toml"),
        ("info", "loop.h5"),
        ("verify", "loop.h5"),
        ("plot", "loop.h5", "-o", "x.png"),
        ("plot", "s.h5", "-o", "loop.png"),
        ("paper", "-o", "loop", "--only", "fig02"),
    ):
        assert_refused(run, *arguments, words=["loop", "symbolic links"])
    for arguments in (("info", "s.h5/x.h5"), ("verify", "s.h5/x.h5"), ("plot", "s.h5/x.h5", "-o", "x.png")):
        assert_refused(run, *arguments, words=["s.h5/x.h5", "Not a directory"])
    one = ("trajectory", "sweep.toml", "--set", "A=3", "--set", "eps=0")
    for arguments in (("info", "pipe.h5"), ("verify", "pipe.h5"), ("plot", "pipe.h5", "-o", "x.png"),
                      ("plot", "s.h5", "-o", "pipe.png"), (*one, "-o", "pipe.png")):  # fmt: skip
        assert_refused(run, *arguments, words=["pipe.", "a named pipe"])


def test_configuration_may_be_a_pipe(tmp_path):
    """The configuration in `vibrodrive sweep <(…)` is a pipe of the shell."""
    out, into = os.pipe()
    os.write(into, CONFIGS["sweep"].encode())
    os.close(into)
    try:
        assert config.read(Path(f"/dev/fd/{out}")).plan().n_points == 80
    finally:
        os.close(out)


@pytest.fixture
def small_disk():
    """Limit files to 2000 bytes, which has the same effect as a full disk."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (2000, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, before)
    signal.signal(signal.SIGXFSZ, handler)


def test_full_disk_is_reported_with_the_file_name(tmp_path, small_disk):
    motion = Results({}, {"A": 3.0, "B": 0.1, "eps": 0.0}, config.parse("[sweep]\nA = 3").plan().settings, {
        "section": np.ones((250, 2)), "status": np.zeros((), np.int8), "margin": np.ones(()),
        "switches": np.zeros(5, np.int64)})  # fmt: skip
    with pytest.raises(OSError, match="File too large") as error:
        save(figures.poincare(motion), tmp_path / "x.png")
    assert error.value.filename == str(tmp_path / "x.png")
    with pytest.raises(OSError, match=r"x\.h5: File too large"), new_file(tmp_path / "x.h5") as file:
        file["x"] = np.ones(10_000)
    assert list(tmp_path.iterdir()) == []


# addresses of a Dask scheduler


@pytest.mark.parametrize(
    "address", ["foo", "", "foo://x:1", "tcp://x", "x:port", "tcp://x:0", "tcp://x:99999", "inproc://1/2/3", "a b:1"]
)
def test_bad_scheduler_addresses_are_refused(run, idle, address):
    assert_refused(run, "sweep", "sweep.toml", "--dask", address, words=["--dask", address, "tcp://scheduler:8786"])


@pytest.mark.parametrize("address", ["tcp://scheduler:8786", "10.0.0.1:8786", "tls://[::1]:8786", "node-1.cluster:1"])
def test_scheduler_addresses_are_accepted(address):
    pytest.importorskip("distributed")
    runner.check_dask(address)


def test_dask_without_its_extra_is_refused(run, idle, monkeypatch):
    monkeypatch.setattr(runner, "find_spec", lambda name: None)
    assert_refused(run, "sweep", "sweep.toml", "--dask", "tcp://127.0.0.1:1", words=["pip install 'vibrodrive[dask]'"])


# sweeps without an axis


@pytest.mark.integration
def test_sweep_of_one_motion_has_its_section_drawn(run, monkeypatch):
    sweep = import_module("vibrodrive.batch.sweep")
    monkeypatch.setattr(sweep, "run_blocks", lambda plan, which, **o: fake.run_blocks(plan))
    monkeypatch.setattr(sweep, "load_kernels", lambda plan: None)
    Path("d.toml").write_text(CONFIGS["sweep"] + '[figure]\nkind = "bifurcation"\nx = "A"\n')
    code, _, err = run("sweep", "d.toml", "--set", "A=3.17", "--set", "eps=0", "--plot")
    assert code == 0, err
    assert Path("d.png").read_bytes()[:4] == b"\x89PNG"
    (ax,) = vd.load("d.h5").plot().axes
    section = vd.load("d.h5").section
    assert sorted(ax.lines[0].get_xdata()) == pytest.approx(sorted(section[:, 0]), abs=1e-9)
    assert "3.17" in ax.get_title(loc="right")
    assert_refused(run, "plot", "d.h5", "--kind", "bifurcation", words=["--kind", "poincare"])
    with pytest.raises(ValueError, match="axes = none: must be at least one"):
        figures.bifurcation(vd.load("d.h5"))


def test_abscissa_must_be_an_axis(run, idle):
    Path("d.toml").write_text(CONFIGS["sweep"] + '[figure]\nx = "A"\n')
    assert_refused(run, "sweep", "d.toml", "--set", "A=3.17", "--plot", words=["figure.x = 'A'", "eps"])


def endless(file, progress):
    while True:
        pass


def crashing(file, progress):
    os.kill(os.getpid(), signal.SIGKILL)


@pytest.mark.skipif(os.name != "posix", reason="alarms")
@pytest.mark.parametrize(("read", "words"), [(endless, "has made no progress for 1 s"), (crashing, "crashes")])
def test_file_that_makes_hdf5_loop_or_crash_is_damaged(read, words):
    with pytest.raises(Damaged, match=f"x.h5: too damaged to be read .HDF5 {words}"):
        read_in_process(Path("x.h5"), read, patience=1)
