"""Tests of the machine code that comes with the package: where it is used, and that it gives what Numba compiles."""

import ctypes
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import build_kernels
from tests.support.process import python
from vibrodrive.explorer.density import darken
from vibrodrive.jit import shipped
from vibrodrive.periodic.flight import launch_after, launch_window
from vibrodrive.periodic.itineraries import DEPTH, NO_SLIDES, PIECE, flights, split

ROOT = Path(shipped.__file__).parents[1]

V4, V3 = shipped.LEVELS

pytestmark = pytest.mark.jit

WIDE = dict.fromkeys(shipped.LEVELS[V4], True)  # features of a processor


@pytest.fixture
def found(monkeypatch, tmp_path, capsys):
    """Return a function that looks for the code of a kernel as a new process would, on a processor with these features.

    The libraries are not opened, so that this needs neither such a processor nor a compiler of C. `change` changes the
    folder of the libraries. The function returns the kernel, the library that is chosen, and what was said.
    """
    for name in ("VIBRODRIVE_CODE", "NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(shipped.sys, "platform", "linux")

    def look(cpu=WIDE, change=lambda folder: None):
        features = {} if cpu is None else {"__cpu_features__": cpu}
        opened = [None]
        kernel = SimpleNamespace(kernel0=lambda block: None)
        monkeypatch.setattr(shipped.ctypes, "CDLL", lambda path, *more: opened.append(Path(path).stem) or kernel)
        monkeypatch.setattr(shipped, "import_module", lambda name: SimpleNamespace(**features))
        monkeypatch.setattr(shipped, "FOLDER", tmp_path)
        for level in shipped.LEVELS:
            (tmp_path / f"{level}.so").write_text(level)
        arrays = [{"dtype": dtype, "ndim": 1} for dtype in ("<u2", "<u4")]
        build_kernels.write_table(tmp_path, {darken.name: ["kernel0", arrays, ["u8"] * 3]})
        change(tmp_path)
        shipped._table_and_library.cache_clear()
        return shipped.function(darken.name), opened[-1], capsys.readouterr().err

    yield look
    shipped._table_and_library.cache_clear()


def _damage(folder):
    (folder / f"{V4}.so").write_text("another")


def _edit(folder):
    table = json.loads((folder / shipped.TABLE).read_text())
    (folder / shipped.TABLE).write_text(json.dumps(table | {"sources": "of another version"}))


def _swap(folder):
    text = (folder / shipped.TABLE).read_text()
    (folder / shipped.TABLE).write_text(text.replace("kernel0", "kernel1"))


def _leave_out(folder):
    (folder / f"{V4}.so").unlink()
    build_kernels.write_table(folder, json.loads((folder / shipped.TABLE).read_text())["kernels"])


UNKNOWN = f"must be {V3} or numba here)\n"

CODES = [
    ({"cpu": WIDE}, V4, ""),
    ({"cpu": WIDE | {"AVX512VL": False}}, V3, ""),
    ({"cpu": WIDE | {"MOVBE": False}}, None, ""),
    ({"cpu": {name: True for name in WIDE if name.startswith(("AVX", "FMA"))}}, V4, ""),  # NumPy before 2.4
    ({"cpu": dict.fromkeys(WIDE, False)}, None, ""),
    ({"cpu": {}}, None, ""),  # another processor
    ({"cpu": None}, None, "__cpu_features__"),  # otherwise a program would compile for a minute without a word
    ({"change": _leave_out}, V3, ""),
    ({"change": lambda folder: (folder / f"{V4}.so").unlink()}, V3, ""),
    ({"change": _damage}, None, f"{V4}.so is damaged"),
    ({"change": lambda folder: (folder / shipped.TABLE).write_text("{")}, None, "Expecting property name"),
    ({"change": _swap}, None, f"{shipped.TABLE} is damaged"),
    ({"change": _edit}, None, ""),  # an edited source is compiled, as in a clone
    ({"change": lambda folder: (folder / shipped.TABLE).unlink()}, None, ""),
    ({"VIBRODRIVE_CODE": "numba"}, None, ""),
    ({"VIBRODRIVE_CODE": V3}, V3, ""),
    ({"VIBRODRIVE_CODE": ""}, V4, ""),
    ({"NUMBA_CPU_NAME": "generic"}, None, ""),
    ({"NUMBA_CPU_FEATURES": "+avx2"}, None, ""),
    ({"VIBRODRIVE_CODE": V4, "change": _leave_out}, None, f"(VIBRODRIVE_CODE = {V4}: {UNKNOWN}"),
    ({"VIBRODRIVE_CODE": "avx2", "change": _leave_out}, None, f"(VIBRODRIVE_CODE = avx2: {UNKNOWN}"),
]


@pytest.mark.parametrize(("given", "level", "says"), CODES)
def test_widest_code_of_these_sources_that_the_processor_can_run_is_taken(found, monkeypatch, given, level, says):
    for name in given.keys() - {"cpu", "change"}:
        monkeypatch.setenv(name, given[name])
    run, opened, said = found(**{name: given[name] for name in ("cpu", "change") if name in given})
    assert (opened, run is not None) == (level, level is not None)
    assert said.count("\n") == bool(says)
    assert says in said


def test_arrays_of_other_kinds_are_refused(found):
    run, *_ = found()
    for wrong in (np.zeros(4), np.zeros((2, 2), np.uint16), np.zeros(8, np.uint16)[::2]):
        with pytest.raises(TypeError, match="must be a contiguous uint16 array of 1 dimensions"):
            run(wrong, np.zeros(4, np.uint32))


@pytest.mark.skipif(shutil.which("qemu-x86_64") is None, reason="needs qemu-x86_64 (Debian: qemu-user)")
def test_an_emulated_processor_is_asked():
    """/proc/cpuinfo describes the real one, whose machine code would end the process."""
    script = "from vibrodrive.jit.shipped import LEVELS, can_run; print([*map(can_run, LEVELS)])"
    command = ["qemu-x86_64", "-cpu", "SandyBridge", sys.executable, "-c", script]
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout == "[False, False]\n"


def test_other_systems_get_no_machine_code(monkeypatch):
    monkeypatch.setattr(shipped.sys, "platform", "darwin")
    assert not any(map(shipped.can_run, shipped.LEVELS))


LEVEL = next(filter(shipped.can_run, shipped.LEVELS), None)

KERNELS = [darken, launch_after, launch_window, flights, split]

MAKE = f"""
import sys
from pathlib import Path
from tests.jit.test_shipped import KERNELS
from build_kernels import make_library, write_table
folder = Path(sys.argv[1])
write_table(folder, make_library("{LEVEL}", folder, KERNELS))
"""


def make(folder, seed):
    """Make a library of KERNELS in a new process, whose sets have another order for another `seed`."""
    python(MAKE, folder, PYTHONHASHSEED=seed, NUMBA_CACHE_DIR=str(folder / "cache"))


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A folder with a library of KERNELS for this processor, and the table."""
    if LEVEL is None:
        pytest.skip("no Linux on x86-64-v3")
    try:
        build_kernels._linker()
    except FileNotFoundError as error:
        pytest.skip(str(error))
    folder = tmp_path_factory.mktemp("shipped")
    make(folder, "1")
    return folder


def _split(run):
    cells, stack = np.zeros((64, 5)), np.empty(DEPTH, PIECE)
    cells[0, :2] = 0.4, 1.2
    _, found, _ = under_way = run(2, 3.04, 0.1, 16, np.empty(0, np.int64), 10**6, (0, 1, -1), cells, stack)
    return under_way, cells[:found].tolist()


def _darken(run):
    image, counts = np.zeros((5, 3), np.uint8), np.zeros(5, np.int64)
    run(np.array([[0.1, 0.5, np.nan], [0.9, 0.91, 2.0]]), np.array([0, 2]), 0.0, 1.0, _SHADES, counts, image)
    return image.tolist()


_SHADES = np.array([0, 9, 7, 5], np.uint8)

CALLS = {
    darken: _darken,
    launch_after: lambda run: run(7.0, 3.04, 0.1),
    launch_window: lambda run: run(3.04, 0.0),
    flights: lambda run: run(0.5, 3, 3, 0.1, 16, NO_SLIDES),  # the first 3 is an integer; the second is A
    split: _split,
}


@pytest.mark.parametrize("kernel", KERNELS, ids=lambda kernel: kernel.__name__)
def test_shipped_code_gives_what_numba_compiles(made, monkeypatch, kernel):
    """All kinds of arguments and results occur: numbers, truth values, tuples, arrays, nothing."""
    table = json.loads((made / shipped.TABLE).read_text())
    opened = table["kernels"], ctypes.CDLL(str(made / f"{LEVEL}.so"))
    monkeypatch.setattr(shipped, "_table_and_library", lambda: opened)
    assert CALLS[kernel](shipped.function(kernel.name)) == CALLS[kernel](kernel.dispatcher)


def test_every_kernel_is_shipped():
    """Each function of the package that is marked as a kernel is made, except the loop of Numba's threads."""
    kernels = list(build_kernels.kernels())
    assert len({kernel.name for kernel in kernels}) == len(kernels) > 25
    made = {(kernel.__module__, kernel.__name__) for kernel in kernels}
    marked = set()
    for path in ROOT.rglob("*.py"):
        name = ".".join(path.relative_to(ROOT.parent).with_suffix("").parts)
        found = re.findall(r"^ *@jit\b.*\n(?: .*\n|\)\n)*? *def (\w+)", path.read_text("utf-8"), re.MULTILINE)
        marked |= {(name, function) for function in found}
    assert marked - made == {("vibrodrive.batch.prange", "run_on_threads")}
    assert made <= marked


def test_two_builds_give_the_same_bytes(made, tmp_path):
    make(tmp_path, "2")
    assert [(tmp_path / name).read_bytes() for name in (f"{LEVEL}.so", shipped.TABLE)] == [
        (made / name).read_bytes() for name in (f"{LEVEL}.so", shipped.TABLE)
    ]


def test_a_linker_is_asked_for(monkeypatch):
    monkeypatch.setattr(build_kernels, "which", lambda command: None)
    monkeypatch.setattr(build_kernels, "find_spec", lambda name: SimpleNamespace(name=name))
    assert build_kernels._linker() == [sys.executable, "-m", "ziglang", "cc"]
    monkeypatch.setattr(build_kernels, "find_spec", lambda name: None)
    with pytest.raises(FileNotFoundError, match="no compiler of C was found"):
        build_kernels._linker()
