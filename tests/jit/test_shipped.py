"""Tests of the machine code that comes with the package: a library of a few kernels gives what Numba compiles."""

import json
import re
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from tests.support.process import python
from vibrodrive.explorer.density import darken
from vibrodrive.jit import shipped
from vibrodrive.jit.fletcher import _RAMP, sums
from vibrodrive.periodic.flight import launch_after, launch_window
from vibrodrive.periodic.itineraries import DEPTH, NO_SLIDES, Pieces, flights, split
from vibrodrive.shipped import build

ROOT = Path(build.__file__).parents[1]

LEVEL = "x86-64-v3"

pytestmark = [
    pytest.mark.jit,
    pytest.mark.skipif(not shipped.can_run(LEVEL), reason="no Linux on x86-64-v3"),
]

KERNELS = [sums, darken, launch_after, launch_window, flights, split]


MAKE = f"""
import sys
from pathlib import Path
from tests.jit.test_shipped import KERNELS
from vibrodrive.shipped.build import make_library, write_table
folder = Path(sys.argv[1])
write_table(folder, make_library("{LEVEL}", folder, KERNELS))
"""


def make(folder, seed):
    """Make a library of KERNELS in a new process, whose sets have another order for another `seed`."""
    python(MAKE, folder, PYTHONHASHSEED=seed, NUMBA_CACHE_DIR=str(folder / "cache"))


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A folder with a library of KERNELS, and the table."""
    folder = tmp_path_factory.mktemp("shipped")
    make(folder, "1")
    return folder


@pytest.fixture
def found(made, monkeypatch, tmp_path, capsys):
    """Return a function that looks for the code of a kernel as a new process would, in a copy of the folder `made`.

    `change` changes the copy. The function returns the code and what was said.
    """
    for name in ("VIBRODRIVE_CODE", "NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES"):
        monkeypatch.delenv(name, raising=False)

    def look(kernel=sums, change=lambda folder: None):
        for path in (made / f"{LEVEL}.so", made / shipped.TABLE):
            (tmp_path / path.name).write_bytes(path.read_bytes())
        change(tmp_path)
        monkeypatch.setattr(shipped, "FOLDER", tmp_path)
        shipped._table_and_library.cache_clear()
        return shipped.function(kernel.name), capsys.readouterr().err

    yield look
    shipped._table_and_library.cache_clear()


def _split(run):
    ends, pieces = np.empty((64, 2)), Pieces(np.empty((DEPTH, 2)), np.empty((DEPTH, 2), np.int64), NO_SLIDES)
    under_way = np.array([-1, 0])
    return run((0.4, 1.2), 2, 3.04, 0.1, 16, 10**6, under_way, ends, pieces), ends[: under_way[1]].tolist()


def _darken(run):
    image, counts = np.zeros((5, 3), np.uint8), np.zeros(5, np.int64)
    run(np.array([[0.1, 0.5, np.nan], [0.9, 0.91, 2.0]]), np.array([0, 2]), 0.0, 1.0, _SHADES, counts, image)
    return image.tolist()


_SHADES = np.array([0, 9, 7, 5], np.uint8)

CALLS = {
    sums: lambda run: run(np.arange(1000, dtype=np.uint16), _RAMP),
    darken: _darken,
    launch_after: lambda run: run(7.0, 3.04, 0.1),
    launch_window: lambda run: run(3.04, 0.0),
    flights: lambda run: run(0.5, 3, 3, 0.1, 16, NO_SLIDES),  # the first 3 is an integer; the second is A
    split: _split,
}


@pytest.mark.parametrize("kernel", KERNELS, ids=lambda kernel: kernel.__name__)
def test_shipped_code_gives_what_numba_compiles(found, kernel):
    """All kinds of arguments and results occur: numbers, truth values, tuples, arrays, nothing."""
    run, said = found(kernel)
    assert said == ""
    assert CALLS[kernel](run) == CALLS[kernel](kernel.dispatcher)


def test_arrays_of_other_kinds_are_refused(found):
    run, _ = found(sums)
    for wrong in (np.zeros(4), np.zeros((2, 2), np.uint16), np.zeros(8, np.uint16)[::2]):
        with pytest.raises(TypeError, match="must be a contiguous uint16 array of 1 dimensions"):
            run(wrong, _RAMP)


def _damage(folder):
    path = folder / f"{LEVEL}.so"
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def _edit(folder):
    table = json.loads((folder / shipped.TABLE).read_text())
    (folder / shipped.TABLE).write_text(json.dumps(table | {"sources": "of another version"}))


def _swap(folder):
    text = (folder / shipped.TABLE).read_text()
    (folder / shipped.TABLE).write_text(text.replace("kernel1", "kernel2"))


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (_damage, f"{LEVEL}.so is damaged"),
        (lambda folder: (folder / f"{LEVEL}.so").write_bytes(b""), f"{LEVEL}.so is damaged"),
        (lambda folder: (folder / shipped.TABLE).write_text("{"), "Expecting property name"),
        (_swap, f"{shipped.TABLE} is damaged"),
        (_edit, ""),  # an edited source is compiled, as in a clone
        (lambda folder: (folder / shipped.TABLE).unlink(), ""),
        (lambda folder: (folder / f"{LEVEL}.so").unlink(), ""),
    ],
)
def test_code_that_is_not_of_these_sources_is_compiled(found, change, says):
    run, said = found(change=change)
    assert run is None
    assert said.count("\n") == bool(says)
    assert says in said
    assert found()[0] is not None


@pytest.mark.parametrize(
    ("name", "value", "used"),
    [
        ("VIBRODRIVE_CODE", "numba", False),
        ("VIBRODRIVE_CODE", LEVEL, True),
        ("VIBRODRIVE_CODE", "x86-64-v4", False),  # the folder has no library of this kind
        ("VIBRODRIVE_CODE", "", True),
        ("NUMBA_CPU_NAME", "generic", False),
        ("NUMBA_CPU_FEATURES", "+avx2", False),
    ],
)
def test_variables_choose_the_code(found, monkeypatch, name, value, used):
    monkeypatch.setenv(name, value)
    assert (found()[0] is not None) == used


def test_code_that_does_not_exist_is_named(found, monkeypatch):
    monkeypatch.setenv("VIBRODRIVE_CODE", "avx2")
    run, said = found()
    assert run is None
    assert re.search(r"VIBRODRIVE_CODE = avx2: must be (x86-64-v4 or )?x86-64-v3 or numba here\)\n$", said)


@pytest.mark.parametrize(
    ("features", "level"),
    [
        (shipped.LEVELS["x86-64-v4"], "x86-64-v4"),
        ((*shipped.LEVELS[LEVEL], "avx512f"), LEVEL),
        (shipped.LEVELS[LEVEL][:-1], None),  # without xsave the system saves no wide registers
        ((), None),
    ],
)
def test_widest_library_that_the_processor_can_run_is_taken(found, monkeypatch, features, level):
    monkeypatch.setattr(shipped, "_features", lambda: set(features))
    opened = []
    monkeypatch.setattr(
        shipped.ctypes, "CDLL", lambda path, *more: opened.append(path) or SimpleNamespace(kernel0=sums)
    )

    def add(folder):
        (folder / "x86-64-v4.so").write_bytes(b"wide")
        build.write_table(folder, json.loads((folder / shipped.TABLE).read_text())["kernels"])

    run, _ = found(change=add)
    assert (run is not None) == (level is not None)
    assert [path.rpartition("/")[2] for path in opened[1:]] == ([f"{level}.so"] if level else [])


def test_every_kernel_is_shipped():
    """Each function of the package that is marked as a kernel is made, except the loop of Numba's threads."""
    kernels = list(build.kernels())
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


NUMBA_FREE = """
import sys
import vibrodrive as vd
from vibrodrive.model.config import read
import vibrodrive.batch.sweep, vibrodrive.periodic.search, vibrodrive.stability.limit, vibrodrive.explorer.work
print(sorted({"numba", "llvmlite"} & {*sys.modules}))
"""


def test_the_modules_that_compute_are_imported_without_numba():
    assert python(NUMBA_FREE) == "[]\n"


def test_a_linker_is_asked_for(monkeypatch):
    monkeypatch.setattr(build, "which", lambda command: None)
    monkeypatch.setattr(build, "find_spec", lambda name: SimpleNamespace(name=name))
    assert build._linker() == [sys.executable, "-m", "ziglang", "cc"]
    monkeypatch.setattr(build, "find_spec", lambda name: None)
    with pytest.raises(FileNotFoundError, match="no compiler of C was found"):
        build._linker()


def test_other_systems_get_no_machine_code(monkeypatch):
    monkeypatch.setattr(shipped.platform, "machine", lambda: "aarch64")
    assert shipped._features() == set()
