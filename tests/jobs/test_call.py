"""`vd.sweep` into a file does the same as `vibrodrive sweep`. Progress appears on terminals and in notebooks only."""

import io
import sys
import time
import types
from pathlib import Path

import h5py
import numpy as np
import pytest

import vibrodrive as vd
from tests.support import fake
from vibrodrive.cli import cli
from vibrodrive.errors import Different
from vibrodrive.jobs import progress
from vibrodrive.model.config import parse
from vibrodrive.model.plan import make_plan
from vibrodrive.model.toml import as_toml
from vibrodrive.store.compare import compare
from vibrodrive.store.layout import Origin
from vibrodrive.store.reader import verify

SWEEP = {"A": np.linspace(1, 2, 3000), "transient": 0, "periods": 1}
"""A sweep of three blocks."""


@pytest.fixture
def quick(quick, tmp_path, monkeypatch):
    """Replace the kernels as the fixture `quick` of conftest.py does, and work in an empty directory."""
    monkeypatch.chdir(tmp_path)
    return quick


def command(*arguments):
    cli.main(["sweep", *arguments], standalone_mode=False)


@pytest.mark.parametrize(
    "arguments",
    [
        {"A": [3.04]},
        {"A": np.random.default_rng(1).random(500), "B": [0.1, 0.2, 0.25], "record": ["summary", "impacts"]},
        {"A": np.linspace(3.25, 3, 7), "dtau": [0.1, 1e-5], "method": "fixed", "budget": 7},
        {"A": [1e9, 0.0, 5e-324, 0.1 + 0.2], "tau0": -0.0, "dxi0": -1.5, "section_phase": [1, 2, 3, 4]},
        {"A": np.linspace(3, 4, 5) * [1, 1 + 1e-12, 1, 1, 1], "eps": np.geomspace(1, 9, 4) * [1, 1 + 1e-12, 1, 1]},
        {"A": np.full(5, 2.0), "tol": 1e-9, "method": "muller", "dtau": 0.5, "eta": 3, "xi0": np.arange(4)},
    ],
    ids=str,
)
def test_configuration_of_a_plan_reproduces_the_plan(arguments):
    plan = make_plan({"transient": 3, "periods": 2} | arguments)
    again = parse(as_toml(plan)).plan()
    assert compare(again, plan) == []
    assert list(again.axes) == list(plan.axes)
    assert ("A = {start = 3.25, stop = 3.0, num = 7}" in as_toml(plan)) == (len(arguments["A"]) == 7)


def test_long_list_of_values_is_kept_whole(quick):
    """The configuration is longer than 64 kB, the limit of HDF5 for attributes in the header of an object."""
    A = np.random.default_rng(3).random(5000)
    r = vd.sweep(A=A, transient=0, periods=1, path="long.h5")
    with h5py.File("long.h5") as file:
        assert len(file.attrs["config"]) > 2**16
    assert r.axes["A"].tobytes() == A.tobytes()
    assert verify(Path("long.h5")).sound


def test_call_and_command_resume_files_of_each_other(quick, monkeypatch, capsys):
    vd.sweep(**SWEEP, path="x.h5")
    Path("c.toml").write_text("[sweep]\nA = {start = 1, stop = 2, num = 3000}\n[run]\ntransient = 0\nperiods = 1\n")
    quick.clear()
    command("c.toml", "-o", "x.h5")
    assert quick == []
    command("c.toml", "-o", "y.h5")
    with h5py.File("y.h5", "r+") as file:
        file["status"][1000:2000] = vd.Status.NOT_COMPUTED
    quick.clear()
    assert vd.sweep(**SWEEP, path=Path("y.h5")).computed == 1.0
    assert quick == [1]
    monkeypatch.setattr("vibrodrive.store.layout.__version__", "0.0.9")
    fake.write(Path("z.h5"), make_plan(SWEEP), Origin(Path("c.toml").read_text()), [0])
    command("c.toml", "-o", "z.h5")
    assert f"z.h5: begun by vibrodrive 0.0.9, continued by {vd.__version__}\n" in capsys.readouterr().err


def test_existing_files_are_refused_or_replaced_as_by_the_command(quick):
    vd.sweep(**SWEEP, path="x.h5")
    before = Path("x.h5").read_bytes()
    # the file is sound, so the message does not propose to overwrite it
    with pytest.raises(Different, match=r"B is 0\.1 in the file and 0\.2 in the config.* choose another file$"):
        vd.sweep(**SWEEP, B=0.2, path="x.h5")
    Path("notes.h5").write_text("precious")
    for overwrite in (False, True):
        with pytest.raises(ValueError, match=r"notes\.h5'?: not a result file.*only result files are overwritten"):
            vd.sweep(**SWEEP, path="notes.h5", overwrite=overwrite)
    for wrong in ({"threads": 0}, {"executor": 3}):
        with pytest.raises((TypeError, ValueError), match=f"^{next(iter(wrong))} = "):
            vd.sweep(**SWEEP, path="new.h5", **wrong)
    assert Path("x.h5").read_bytes() == before
    assert Path("notes.h5").read_text() == "precious"
    assert sorted(p.name for p in Path().iterdir()) == ["notes.h5", "x.h5"]
    assert vd.sweep(**SWEEP, B=0.2, path="x.h5", overwrite=True).scalars["B"] == 0.2


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_progress_is_shown_on_a_terminal_only(quick, monkeypatch, capfd):
    vd.sweep(**SWEEP, path="x.h5")
    assert capfd.readouterr() == ("", "")
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setattr(progress, "SHOWN_AFTER", 0.0)
    vd.sweep(**SWEEP, path="y.h5")
    shown = terminal.getvalue()
    assert "\r\x1b[Ky.h5  " in shown  # this line is overwritten
    assert "\ny.h5: 3000 points in " in shown.replace("\x1b[K", "\n")
    vd.sweep(**SWEEP, path="y.h5")
    assert terminal.getvalue().endswith("y.h5 is complete: nothing to compute\n")


@pytest.mark.parametrize(
    ("place", "call", "line"),
    [
        ("batch.trajectory.follow", vd.simulate, "simulate  under way: "),
        ("stability.limit.LimitSearch.run", vd.limit, "limit  under way: "),
        ("batch.sweep.collect", vd.sweep, "sweep    0.0 %"),
    ],
)
def test_long_call_shows_its_progress(monkeypatch, place, call, line):
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setattr(progress, "SHOWN_AFTER", 0.0)

    def work(*arguments, **options):
        """Wait until the line appears, or for one minute."""
        for _ in range(600):
            if line in terminal.getvalue():
                raise InterruptedError
            time.sleep(0.1)

    monkeypatch.setattr(f"vibrodrive.{place}", work)
    with pytest.raises(InterruptedError):
        call(A=3.0, transient=10**9)
    assert terminal.getvalue().endswith("\r\x1b[K")  # the line is removed at the end


class Notebook(types.ModuleType):
    """The parts of IPython that the display of progress uses in a notebook."""

    def __init__(self, shell):
        super().__init__("IPython")
        self.cells = []
        self.get_ipython = lambda: shell
        self.display = types.ModuleType("IPython.display")
        self.display.display = self._display

    def _display(self, content, raw, display_id):
        assert raw
        assert display_id
        self.cells.append([content["text/plain"]])
        cell = self.cells[-1]
        return types.SimpleNamespace(update=lambda content, raw: cell.append(content["text/plain"]))


def test_progress_is_shown_below_a_notebook_cell(quick, monkeypatch, capfd):
    notebook = Notebook(types.SimpleNamespace(kernel=object()))
    monkeypatch.setitem(sys.modules, "IPython", notebook)
    monkeypatch.setitem(sys.modules, "IPython.display", notebook.display)
    vd.sweep(**SWEEP, path="x.h5")
    (cell,) = notebook.cells
    assert cell[-1].startswith("x.h5: 3000 points in ")
    show = progress.make_display("y.h5")
    show.update(lambda: "1 %")
    show.say("resumed")
    show.update(lambda: "2 %")
    show.clear()
    assert notebook.cells[-1] == ["y.h5  1 %", "resumed", "resumed\ny.h5  2 %", "resumed"]
    assert capfd.readouterr() == ("", "")
    monkeypatch.setitem(sys.modules, "IPython", Notebook(types.SimpleNamespace()))  # IPython in a terminal
    monkeypatch.setattr(sys, "stderr", Terminal())
    assert type(progress.make_display("x.h5")) is progress.Show
