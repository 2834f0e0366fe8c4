"""Files of every kind: none is destroyed by mistake, each says what it holds, and what cannot be used is refused."""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import h5py
import numpy as np
import pytest

import vibrodrive as vd
from tests.support import fake
from vibrodrive import cli
from vibrodrive.cli.files import read_apart
from vibrodrive.errors import Damaged, NoResult, OtherKind
from vibrodrive.figures import diagrams as figures
from vibrodrive.figures.failures import failures_figure
from vibrodrive.figures.limits import limits_figure
from vibrodrive.figures.orbits import multiplier_diagram
from vibrodrive.figures.style import save
from vibrodrive.jobs import sweep as runner
from vibrodrive.model import config
from vibrodrive.model.results import Results
from vibrodrive.store.file import new_file
from vibrodrive.store.header import read_kind
from vibrodrive.store.layout import Origin, digest
from vibrodrive.store.writer import open_writer

ROOT = Path(__file__).parents[2]

CONFIGS = {
    "sweep": "[sweep]\nA = {start = 3.0, stop = 3.25, num = 40}\neps = [0, 2e-4]\n[run]\ntransient = 0\nperiods = 6\n",
    "limits": '[sweep]\nA = [2.5]\n[run]\ntransient = 60\nperiods = 60\n[limits]\ncriterion = "word"\n',
    "orbits": "[sweep]\nA = {start = 2.59, stop = 2.62, num = 4}\n[run]\ntransient = 50\nperiods = 8\n"
    "section_phase = 2.0\n[orbits]\nmax_period = 2\n",
    "atlas": "[sweep]\nA = [1.5, 3.04]\ndtau = [0.01, 0.1]\n[model]\neps = 2e-4\n[run]\ntransient = 20\nperiods = 40\n",
}
"""A small configuration for each command that makes a result file."""

KINDS = {"sweep": "sweep", "limits": "limits", "orbits": "orbits", "atlas": "failures"}

REFUSED = ["sweep", "limits", "orbits", "atlas"]


@pytest.fixture
def run(run):
    """The command line, beside the configurations above."""
    for name, text in CONFIGS.items():
        Path(f"{name}.toml").write_text(text)
    return run


@pytest.fixture
def idle(monkeypatch):
    """Nothing is computed: a command that begins to fails the test."""

    def begun(*arguments, **options):
        raise AssertionError("something is computed")

    for name in (
        "batch.sweep.run_blocks", "jobs.limits.each_of", "jobs.orbits.family", "jobs.failures.failures_of_methods",
    ):  # fmt: skip
        module, _, function = name.rpartition(".")
        monkeypatch.setattr(import_module(f"vibrodrive.{module}"), function, begun)


def a_sweep(path, blocks=None, text=CONFIGS["sweep"]):
    """A file of a sweep, of blocks that cost nothing."""
    plan = config.parse(text).plan()
    writer = open_writer(Path(path), plan, Origin(text))
    for block in fake.run_blocks(plan, blocks):
        writer.write(block)
    writer.close()
    return Path(path)


def foreign(path):
    """An HDF5 file of another program, with names that occur here, too."""
    with h5py.File(path, "w") as file:
        file["A"] = np.arange(3.0)
        file["section_xi"] = np.arange(6.0)
        file.attrs["title"] = "precious"


def contents():
    """What every file of the directory holds, and where links lead."""
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


# one file under two names


@pytest.mark.parametrize("command", REFUSED)
@pytest.mark.parametrize("spelling", ["c.toml", "./x/../c.toml", "link.h5", "hard.h5"])
def test_a_result_never_takes_the_place_of_its_configuration(run, idle, command, spelling):
    Path("x").mkdir()
    Path("c.toml").write_text(CONFIGS[command])
    Path("link.h5").symlink_to("c.toml")
    os.link("c.toml", "hard.h5")
    for options in ((), ("--overwrite",)):
        assert_refused(run, command, "c.toml", "-o", spelling, *options, words=["output", "another file", "c.toml"])


@pytest.mark.parametrize("command", REFUSED)
def test_a_configuration_in_the_place_of_the_draft(run, idle, command):
    Path("c.h5.part").write_text(CONFIGS[command])
    assert_refused(run, command, "c.h5.part", "-o", "c.h5", words=["draft", "c.h5.part"])


@pytest.mark.parametrize("command", REFUSED)
def test_a_result_is_no_picture(run, idle, command):
    plotted = ("--plot",) if command == "sweep" else ()
    for name in ("x.png", "x.PDF", "x.svg"):
        assert_refused(
            run, command, f"{command}.toml", "-o", name, *plotted, words=["output", name, f"plot FILE.h5 -o {name}"]
        )


@pytest.mark.parametrize(
    ("command", "config_name", "options"),
    [
        ("sweep", "c.png", ("--plot",)),
        ("limits", "c.png", ()),
        ("atlas", "c.png", ()),
        ("orbits", "c.png", ()),
        ("orbits", "c_multipliers.png", ("-o", "c.h5")),
        ("limits", "c.png.part", ("-o", "c.h5")),
        ("trajectory", "c.png", ("--set", "A=3", "--set", "eps=0", "-o", "c.png")),
        ("trajectory", "c.toml", ("--set", "A=3", "--set", "eps=0", "-o", "link.svg")),
    ],
)
def test_a_figure_never_takes_the_place_of_the_configuration(run, idle, command, config_name, options):
    Path(config_name).write_text(CONFIGS.get(command, CONFIGS["sweep"]))
    Path("link.svg").symlink_to(config_name)
    assert_refused(run, command, config_name, *options, words=["figure", "another file", config_name])


def test_a_figure_never_takes_the_place_of_a_result(run, idle):
    a_sweep("s.h5")
    a_sweep("y.h5").rename("y.png")
    Path("s.png").symlink_to("s.h5")
    os.link("s.h5", "s.pdf")
    assert_refused(run, "plot", "y.png", words=["figure", "y.png", "another file"])
    assert_refused(run, "plot", "s.h5", words=["s.png", "another file"])
    assert_refused(run, "plot", "s.h5", "-o", "s.pdf", words=["s.pdf", "another file"])
    assert_refused(run, "plot", "s.h5", "-o", "y.png", words=["y.png", "holds data"])
    assert_refused(run, "sweep", "sweep.toml", "-o", "s.h5", "--plot", words=["s.png", "another file"])


def test_the_paper_spares_what_is_no_result(run):
    call = ("paper", "--only", "fig02", "-o", "out")
    Path("out").mkdir()
    foreign("out/fig07.h5")
    before = Path("out/fig07.h5").read_bytes()
    code, _, err = run(*call)
    assert (code, err.count("\n")) == (2, 1)
    assert "fig07.h5" in err
    assert Path("out/fig07.h5").read_bytes() == before
    assert [p.name for p in Path("out").iterdir()] == ["fig07.h5"]


@pytest.mark.parametrize("command", REFUSED)
def test_overwrite_replaces_result_files_only(run, idle, command):
    Path("precious.txt").write_text("precious")
    Path("empty.h5").touch()
    foreign("foreign.h5")
    Path("cut.h5").write_bytes(Path("foreign.h5").read_bytes()[:500])
    for name in ("precious.txt", "empty.h5", "foreign.h5", "cut.h5"):
        assert_refused(run, command, f"{command}.toml", "-o", name, "--overwrite", words=[name, "result files only"])
        if name != "cut.h5":  # which may be a damaged one of ours: a failure, not a refusal
            assert_refused(run, command, f"{command}.toml", "-o", name, words=[name])


def test_no_writer_replaces_what_is_no_result(tmp_path):
    path = tmp_path / "precious.h5"
    path.write_text("precious")
    text = CONFIGS["sweep"]
    with pytest.raises(NoResult, match="result files only"):
        open_writer(path, config.parse(text).plan(), Origin(text), overwrite=True)
    with pytest.raises(NoResult, match="result files only"), new_file(path) as file:
        file["x"] = 1.0
    assert path.read_text() == "precious"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("share", [0.5, 0.99])
def test_overwrite_replaces_a_result_that_cannot_be_read_any_more(tmp_path, share):
    path = a_sweep(tmp_path / "s.h5")
    raw = path.read_bytes()
    path.write_bytes(raw[: int(share * len(raw))])
    with pytest.raises(Damaged, match="--overwrite"):
        read_kind(path)
    text = CONFIGS["sweep"]
    open_writer(path, config.parse(text).plan(), Origin(text), overwrite=True).close()
    assert read_kind(path) == "sweep"


def test_a_file_is_there_whole_or_not_at_all(tmp_path):
    path = a_sweep(tmp_path / "s.h5")
    before = path.read_bytes()
    with pytest.raises(KeyError), new_file(path) as file:
        file["x"] = file["y"][...]
    assert path.read_bytes() == before
    link = tmp_path / "link.h5"
    link.symlink_to("there.h5")
    with new_file(link) as file:
        file["x"] = 1.0
    assert link.is_symlink()
    assert (tmp_path / "there.h5").exists()
    assert {p.name for p in tmp_path.iterdir()} == {"s.h5", "link.h5", "there.h5"}


# kinds


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A file of every kind with its figures, as the commands make them."""
    folder = tmp_path_factory.mktemp("kinds")
    a_sweep(folder / "sweep.h5")
    for command in ("limits", "orbits", "atlas"):
        (folder / f"{command}.toml").write_text(CONFIGS[command])
        done = subprocess.run(
            [sys.executable, "-m", "vibrodrive", command, f"{command}.toml"],
            cwd=folder,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            check=True,
            capture_output=True,
            text=True,
        )
        (folder / f"{command}.txt").write_text(done.stdout)
    return folder


@pytest.mark.jit
@pytest.mark.parametrize("command", REFUSED)
def test_every_file_says_its_kind_and_is_described_checked_and_drawn(run, made, command):
    path = Path(f"{command}.h5")
    path.write_bytes((made / path).read_bytes())
    assert read_kind(path) == KINDS[command]
    code, out, err = run("info", str(path))
    assert (code, err) == (0, "")
    assert f"(vibrodrive {command})" in out
    assert "100.0 %" in out
    assert "A = " in out
    code, out, err = run("verify", str(path))
    assert (code, err) == (0, "")
    assert "complete and whole" in out
    code, out, err = run("plot", str(path), "-o", "figure.png")
    assert code == 0, err
    drawn = Path("figure.png").read_bytes()
    assert drawn[:4] == b"\x89PNG"
    if command != "sweep":
        assert drawn == (made / f"{command}.png").read_bytes()


@pytest.mark.jit
@pytest.mark.parametrize("command", REFUSED)
def test_every_kind_is_told_to_programs(run, made, command):
    path = Path(f"{command}.h5")
    path.write_bytes((made / path).read_bytes())
    code, out, err = run("info", str(path), "--json")
    assert (code, err) == (0, "")
    told = json.loads(out)
    assert (told["file"], told["kind"], told["computed"]) == (str(path), KINDS[command], 1.0)
    assert told["axes"]["A"]["num"] >= 1
    assert told["parameters"]["B"] == 0.1
    assert told["versions"]["vibrodrive"] == vd.__version__
    assert told["bytes"] == path.stat().st_size


@pytest.mark.jit
def test_what_is_loaded_is_drawn_as_the_command_draws_it(made, tmp_path):
    found = {name: vd.load(made / f"{name}.h5") for name in ("limits", "atlas")}
    save(limits_figure(found["limits"]), tmp_path / "limits.png")
    save(failures_figure(found["atlas"]), tmp_path / "atlas.png")
    orbits = vd.load(made / "orbits.h5", kind="orbits")
    save(multiplier_diagram(orbits.family), tmp_path / "orbits_multipliers.png")
    for name in ("limits", "atlas", "orbits_multipliers"):
        assert (tmp_path / f"{name}.png").read_bytes() == (made / f"{name}.png").read_bytes()


@pytest.mark.jit
def test_bifurcations_are_listed_for_programs(run, idle, made):
    Path("orbits.h5").write_bytes((made / "orbits.h5").read_bytes())
    code, out, err = run("orbits", "orbits.toml", "--json")
    assert code == 0, err
    told = json.loads(out)
    family = vd.load("orbits.h5", kind="orbits").family
    assert [b["A"] for b in told["bifurcations"]] == [b.A for b in family.bifurcations]
    assert [b["kind"] for b in told["bifurcations"]] == [b.kind for b in family.bifurcations]
    assert sum(told["orbits"].values()) == sum(map(len, family.orbits))


@pytest.mark.jit
def test_both_figures_of_orbits_can_be_drawn_again(run, made):
    Path("o.h5").write_bytes((made / "orbits.h5").read_bytes())
    assert run("plot", "o.h5", "--kind", "multipliers")[0] == 0
    assert Path("o.png").read_bytes() == (made / "orbits_multipliers.png").read_bytes()
    assert run("plot", "o.h5", "--quantity", "xi", "-o", "gap.png")[0] == 0
    assert Path("gap.png").read_bytes() != (made / "orbits.png").read_bytes()


@pytest.mark.jit
def test_what_means_nothing_for_a_kind_is_refused(run, made):
    for command in ("limits", "orbits", "atlas"):
        Path(f"{command}.h5").write_bytes((made / f"{command}.h5").read_bytes())
    assert_refused(run, "plot", "limits.h5", "--quantity", "xi", words=["--quantity", "limits of stability"])
    assert_refused(run, "plot", "atlas.h5", "--kind", "bifurcation", words=["--kind", "failures"])
    assert_refused(run, "plot", "orbits.h5", "--kind", "poincare", words=["--kind", "multipliers"])


@pytest.mark.jit
@pytest.mark.parametrize("command", ["limits", "orbits", "atlas"])
def test_another_kind_is_named_not_called_damaged(run, idle, made, command):
    path = Path("other.h5")
    path.write_bytes((made / f"{command}.h5").read_bytes())
    with pytest.raises(OtherKind, match="not a sweep"):
        vd.load(path, kind="sweep")
    assert_refused(run, "sweep", "sweep.toml", "-o", "other.h5", words=["other.h5", "holds", "a sweep"])
    if command != "limits":
        assert_refused(run, "limits", "limits.toml", "-o", "other.h5", words=["other.h5", "limits of stability"])
    for one in {"orbits", "atlas"} - {command}:
        assert_refused(run, one, f"{one}.toml", "-o", "other.h5", words=["other.h5", "name another with -o"])


@pytest.mark.jit
@pytest.mark.parametrize(
    ("command", "told"), [("limits", "criterion=impacts"), ("orbits", "max_period=1"), ("atlas", "periods=41")]
)
def test_a_complete_file_is_not_computed_again_nor_replaced_by_another(run, monkeypatch, made, command, told):
    """As sweeps always were: of the same configuration, nothing to do; of another, refused with what differs."""

    def begun(*arguments, **options):
        raise AssertionError("something is computed")

    for name in ("stability.limit.search_band", "jobs.orbits.family", "jobs.failures.failures_of_methods"):
        module, _, function = name.rpartition(".")
        monkeypatch.setattr(import_module(f"vibrodrive.{module}"), function, begun)
    path, figure = Path(f"{command}.h5"), Path(f"{command}.png")
    path.write_bytes((made / path).read_bytes())
    # what is written differently, or given anew, is the same
    Path(f"{command}.toml").write_text("# a remark\n" + CONFIGS[command])
    code, _, err = run(command, f"{command}.toml", "--set", "B=0.1")
    assert code == 0, err
    assert "is complete" in err
    assert "nothing to do" in err
    assert path.read_bytes() == (made / path).read_bytes()
    assert figure.read_bytes() == (made / figure).read_bytes()
    for option in ("B=0.2", "transient=21", told):
        name = option.split("=")[0]
        words = ["another configuration", f"{name} is ", " there and ", "--overwrite"]
        assert_refused(run, command, f"{command}.toml", "--set", option, words=words)
    with pytest.raises(AssertionError, match="something is computed"):
        cli.cli.main([command, f"{command}.toml", "--overwrite"], standalone_mode=False)


@pytest.mark.jit
def test_periods_that_were_not_told_are_not_those_of_a_sweep(run, idle, made):
    """Limits have 1500 periods unless given, a sweep has 250."""
    with h5py.File(made / "atlas.h5") as file, h5py.File("atlas.h5", "w") as copy:
        for name in file:
            file.copy(name, copy)
        copy.attrs.update(file.attrs)
        copy.attrs["config"] = CONFIGS["atlas"].replace("periods = 40", "")
        copy.attrs["config_sha256"] = digest(copy.attrs["config"])
    words = ["periods is not given there and 250 here"]
    assert_refused(run, "atlas", "atlas.toml", "--set", "periods=250", words=words)


@pytest.mark.jit
def test_orbits_are_listed_again_from_their_file(run, idle, made, monkeypatch):
    Path("orbits.h5").write_bytes((made / "orbits.h5").read_bytes())
    code, again, err = run("orbits", "orbits.toml")
    assert code == 0, err
    assert again == (made / "orbits.txt").read_text()


@pytest.mark.jit
@pytest.mark.parametrize("command", ["orbits", "atlas"])
def test_a_damaged_file_is_no_complete_one(run, idle, made, command):
    path = Path(f"{command}.h5")
    path.write_bytes((made / path).read_bytes())
    with h5py.File(path, "r+") as file:
        file["A"][0] = 7.0
    code, out, err = run(command, f"{command}.toml")
    assert (code, out) == (1, "")
    assert "damaged" in err
    assert "--overwrite" in err


@pytest.mark.jit
def test_a_result_of_another_kind_may_be_replaced(run, made):
    Path("x.h5").write_bytes((made / "orbits.h5").read_bytes())
    assert run("limits", "limits.toml", "-o", "x.h5", "--overwrite")[0] == 0
    assert read_kind(Path("x.h5")) == "limits"


@pytest.mark.jit
@pytest.mark.parametrize(
    ("command", "name"),
    [("limits", "k2"), ("limits", "A"), ("limits", "how"), ("atlas", "judged"), ("atlas", "dtau"), ("orbits", "phase")],
)
def test_verify_finds_a_flipped_bit_in_any_kind(run, made, command, name):
    path = Path("x.h5")
    path.write_bytes((made / f"{command}.h5").read_bytes())
    with h5py.File(path) as file:
        data = file[name].id
        offset = data.get_offset() if data.get_offset() is not None else data.get_chunk_info(0).byte_offset
    raw = bytearray(path.read_bytes())
    raw[offset + 2] ^= 16
    path.write_bytes(raw)
    code, out, err = run("verify", "x.h5")
    assert code == 1
    assert "whole" not in out
    assert name in err or "contents do not have the SHA-256" in err


@pytest.mark.jit
def test_verify_finds_a_changed_word(run, made):
    """Texts of any length have no checksum of HDF5's: the file has one of its own."""
    path = Path("x.h5")
    path.write_bytes((made / "orbits.h5").read_bytes().replace(b"UP DOWN IMPACT", b"UP DOWM IMPACT"))
    code, _, err = run("verify", "x.h5")
    assert (code, err) == (1, "damaged: the contents do not have the SHA-256 written beside them\n")


def test_a_kind_of_a_later_version_is_named(tmp_path):
    path = a_sweep(tmp_path / "s.h5")
    with h5py.File(path, "r+") as file:
        file.attrs["kind"] = "basins"
    for read in (vd.load, read_kind):
        with pytest.raises(NoResult, match="kind = 'basins': must be one of sweep, limits"):
            read(path)


# names that lead nowhere, pipes, places where nothing can be written


@pytest.mark.parametrize("command", REFUSED)
def test_links_in_a_circle_are_refused(run, idle, command):
    for name in ("loop.h5", "loop.toml", "loop"):
        Path(name).symlink_to(name)
    for name in ("loop.h5", "loop/x.h5"):
        for options in ((), ("--overwrite",)):
            assert_refused(run, command, f"{command}.toml", "-o", name, *options, words=[name, "symbolic links"])
    assert_refused(run, command, "loop.toml", words=["loop.toml", "symbolic links"])


def test_links_in_a_circle_are_refused_by_readers_and_figures(run, idle):
    a_sweep("s.h5")
    for name in ("loop.h5", "loop.png", "loop"):
        Path(name).symlink_to(name)
    for arguments in (
        ("info", "loop.h5"),
        ("verify", "loop.h5"),
        ("plot", "loop.h5"),
        ("plot", "loop.h5", "-o", "x.png"),
        ("plot", "s.h5", "-o", "loop.png"),
        ("paper", "-o", "loop", "--only", "fig02"),
    ):
        assert_refused(run, *arguments, words=["loop", "symbolic links"])


@pytest.mark.parametrize("command", ["sweep", "limits", "orbits", "atlas", "info", "verify", "plot", "trajectory"])
def test_a_named_pipe_is_refused_not_waited_for(run, idle, command):
    a_sweep("s.h5")
    for name in ("pipe.h5", "pipe.toml", "pipe.png"):
        os.mkfifo(name)
    if command in CONFIGS:
        assert_refused(run, command, "pipe.toml", words=["pipe.toml", "a named pipe"])
        into_it = (command, f"{command}.toml", "-o", "pipe.h5")
        for options in ((), ("--overwrite",)):
            assert_refused(run, *into_it, *options, words=["pipe.h5", "a named pipe"])
    elif command == "trajectory":
        one = ("--set", "A=3", "--set", "eps=0")
        assert_refused(run, command, "sweep.toml", *one, "-o", "pipe.png", words=["pipe.png", "a named pipe"])
    else:
        output = ("-o", "x.png") if command == "plot" else ()
        assert_refused(run, command, "pipe.h5", *output, words=["pipe.h5", "a named pipe"])
        if command == "plot":
            assert_refused(run, command, "s.h5", "-o", "pipe.png", words=["pipe.png", "a named pipe"])


def test_a_configuration_may_come_from_the_shell(tmp_path):
    """`vibrodrive sweep <(…)`: such a pipe has a writer."""
    out, into = os.pipe()
    os.write(into, CONFIGS["sweep"].encode())
    os.close(into)
    try:
        assert config.read(Path(f"/dev/fd/{out}")).plan().n_points == 80
    finally:
        os.close(out)


def test_a_directory_that_cannot_be_written_is_the_same_to_every_command(run, idle):
    Path("locked").mkdir()
    a_sweep("locked/s.h5")
    a_sweep("s.h5")
    Path("locked").chmod(0o555)
    if os.access("locked", os.W_OK):
        pytest.skip("the superuser may write anywhere")
    for command in REFUSED:
        assert_refused(run, command, f"{command}.toml", "-o", "locked/x.h5", words=["'locked/x.h5'", "may be written"])
        again = (command, f"{command}.toml", "-o", "locked/s.h5", "--overwrite")
        assert_refused(run, *again, words=["'locked/s.h5'", "may be written"])
    assert_refused(run, "plot", "s.h5", "-o", "locked/x.png", words=["'locked/x.png'", "may be written"])
    assert_refused(run, "plot", "locked/s.h5", words=["'locked/s.png'", "may be written"])
    one = ("trajectory", "sweep.toml", "--set", "A=3", "--set", "eps=0")
    assert_refused(run, *one, "-o", "locked/x.svg", words=["'locked/x.svg'", "may be written"])
    assert_refused(run, "paper", "-o", "locked", "--only", "fig02", words=["locked: Permission denied"])
    Path("locked").chmod(0o755)


@pytest.fixture
def small_disk():
    """No file may grow beyond 2000 bytes: to a program that is as a full disk."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (2000, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, before)
    signal.signal(signal.SIGXFSZ, handler)


def test_a_full_disk_is_said_with_the_name_of_the_file(tmp_path, small_disk):
    motion = Results({}, {"A": 3.0, "B": 0.1, "eps": 0.0}, config.parse("[sweep]\nA = 3").plan().settings, {
        "section": np.ones((250, 2)), "status": np.zeros((), np.int8), "margin": np.ones(()),
        "switches": np.zeros(5, np.int64)})  # fmt: skip
    with pytest.raises(OSError, match="File too large") as error:
        figures.save(figures.poincare(motion), tmp_path / "x.png")
    assert error.value.filename == str(tmp_path / "x.png")
    with pytest.raises(OSError, match=r"x\.h5: File too large"), new_file(tmp_path / "x.h5") as file:
        file["x"] = np.ones(10_000)
    assert list(tmp_path.iterdir()) == []


# a cluster that is not there


@pytest.mark.parametrize(
    "address", ["foo", "", "foo://x:1", "tcp://x", "x:port", "tcp://x:0", "tcp://x:99999", "inproc://1/2/3", "a b:1"]
)
def test_what_is_no_address_of_a_scheduler_is_refused(run, idle, address):
    assert_refused(run, "sweep", "sweep.toml", "--dask", address, words=["--dask", address, "tcp://scheduler:8786"])


@pytest.mark.parametrize("address", ["tcp://scheduler:8786", "10.0.0.1:8786", "tls://[::1]:8786", "node-1.cluster:1"])
def test_addresses_of_schedulers(address):
    pytest.importorskip("distributed")
    runner.check_dask(address)


def test_dask_without_its_extra_is_refused(run, idle, monkeypatch):
    monkeypatch.setattr(runner, "find_spec", lambda name: None)
    assert_refused(run, "sweep", "sweep.toml", "--dask", "tcp://127.0.0.1:1", words=["pip install 'vibrodrive[dask]'"])


# no axis left


@pytest.mark.integration
def test_a_sweep_of_one_motion_has_its_section_drawn(run, monkeypatch):
    sweep = import_module("vibrodrive.batch.sweep")
    monkeypatch.setattr(sweep, "run_blocks", lambda plan, which, **o: fake.run_blocks(plan))
    monkeypatch.setattr(sweep, "load_kernels", lambda plan: None)
    Path("d.toml").write_text(CONFIGS["sweep"] + '[figure]\nkind = "bifurcation"\nx = "A"\n')
    code, _, err = run("sweep", "d.toml", "--set", "A=3.17", "--set", "eps=0", "--plot")
    assert code == 0, err
    assert Path("d.png").read_bytes()[:4] == b"\x89PNG"
    (ax,) = figures.from_results(vd.load("d.h5"), kind="bifurcation").axes
    section = vd.load("d.h5").section
    assert sorted(ax.lines[0].get_xdata()) == pytest.approx(sorted(section[:, 0]), abs=1e-9)
    assert "3.17" in ax.get_title(loc="right")
    assert_refused(run, "plot", "d.h5", "--kind", "bifurcation", words=["--kind", "poincare"])
    with pytest.raises(ValueError, match="axes = 'none': must be at least one"):
        figures.bifurcation(vd.load("d.h5"))


def test_an_abscissa_that_is_no_axis_is_refused_before_anything_is_computed(run, idle):
    Path("d.toml").write_text(CONFIGS["sweep"] + '[figure]\nx = "A"\n')
    assert_refused(run, "sweep", "d.toml", "--set", "A=3.17", "--plot", words=["figure.x = 'A'", "eps"])


def endless(file, progress):
    while True:
        pass


def crashing(file, progress):
    os.kill(os.getpid(), signal.SIGKILL)


@pytest.mark.skipif(os.name != "posix", reason="alarms")
@pytest.mark.parametrize(("read", "words"), [(endless, "has not read on for 1 s"), (crashing, "crashes")])
def test_a_file_on_which_hdf5_loops_or_crashes_is_damaged(read, words):
    with pytest.raises(Damaged, match=f"x.h5: damaged beyond reading .HDF5 {words}"):
        read_apart(Path("x.h5"), read, patience=1)
