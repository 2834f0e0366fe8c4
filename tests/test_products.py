"""Each record keeps each promise: in memory, in a file, interrupted, damaged, on an executor, as tables and figures.

The cases are made from the table of records, so that a new record is tested because it exists.
"""

import copy
import functools
import pickle
import re
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr

import vibrodrive as vd
from tests.store.test_rewritten import CHUNKED, FORMS, rewrite, save_by_xarray
from vibrodrive.errors import NoResult
from vibrodrive.model import plan
from vibrodrive.model.own import Own
from vibrodrive.model.records import RECORDS
from vibrodrive.store.layout import variables_of
from vibrodrive.store.reader import DamagedBlock, look, verify
from vibrodrive.store.writer import Writer

pytestmark = [pytest.mark.jit, pytest.mark.filterwarnings("ignore:.*RAISED")]


def settling(motion, least=0.0):
    """Return the period of the last impact, and the number of switches."""
    if motion.arguments["A"] < least:
        raise ValueError("too small")
    return {"last": motion.impacts["period"][-1], "total": len(motion.switches)}


def nearest(motion):
    return motion.margin


SETTLING, NEAREST = vd.own(settling, version="1"), vd.own(nearest, version="1")
TOGETHER = [name for name, one in RECORDS.items() if not one.alone]
CASES = {name: name for name in RECORDS} | {
    "function": SETTLING,
    "section, function": ["section", SETTLING],
    "summary, function": ["summary", SETTLING],
    "two functions": [SETTLING, NEAREST],
    "a function that raises": vd.own(functools.partial(settling, least=1.4), version="1"),
    (ALL := "all of one motion"): [*TOGETHER, SETTLING],
}
FUNCTIONS = [
    name
    for name, record in CASES.items()
    if any(isinstance(one, Own) for one in (record if isinstance(record, list) else [record]))
]
SETTLED = 'vd.own(settling, version="1")'
TOLD = {
    "function": SETTLED,
    "section, function": f'["section", {SETTLED}]',
    "summary, function": f'["summary", {SETTLED}]',
    "two functions": f'[{SETTLED}, vd.own(nearest, version="1")]',
    "a function that raises": SETTLED,
    "all of one motion": f'["section", "impacts", "summary", "error", {SETTLED}]',
}
"""The records with functions, as advice names them"""


def arguments(name):
    """Return the sweep of a case: 14 points in 7 blocks (`small_blocks`). With a slow ripple a limit is found soon."""
    found = {"A": np.linspace(1.25, 1.55, 7), "B": [0.1, 0.12], "transient": 5, "periods": 9, "record": CASES[name]}
    return found | {"failures": {"method": "fixed", "dtau": 0.1}, "limit": {"eta": 5.0}, "always": {"eta": 5.3}}.get(
        name, {}
    )


each = pytest.mark.parametrize("name", CASES)


@pytest.fixture(autouse=True)
def small_blocks(monkeypatch):
    monkeypatch.setattr(plan, "LEAST_POINTS", 2)
    for kind in {Own, *map(type, RECORDS.values())}:
        monkeypatch.setattr(kind, "block_points", 2)


def sweep(name, path=None, **options):
    return vd.sweep(**arguments(name), path=path, **options)


@functools.cache
def uninterrupted(name, folder):
    path = Path(folder) / f"{name}.h5"
    sweep(name, path)
    return path.read_bytes()


@pytest.fixture
def whole(name, tmp_path, tmp_path_factory):
    """Return the path of the complete file of a case."""
    folder = tmp_path_factory.getbasetemp() / "whole"
    folder.mkdir(exist_ok=True)
    path = tmp_path / "whole.h5"
    path.write_bytes(uninterrupted(name, folder))
    return path


def arrays(results):
    """Return all arrays, the status last, because damage that is found in another array changes it."""
    names = ["margin", "switches", *(q.name for q in results.quantities), "status"]
    return {n: np.asarray(results[n]) for n in [*(["section"] if "section" in results.record else []), *names]}


def same(one, other):
    """Return True if all numbers have the same bits; files may count switches in fewer bytes."""
    one, other = arrays(one), arrays(other)
    return one.keys() == other.keys() and all(
        a.astype(other[n].dtype).tobytes() == other[n].tobytes() for n, a in one.items()
    )


def interrupt(name, path, blocks, patch, killed=False):
    """Compute a part of a file: `blocks` blocks, and then an interruption, or what the system has after a kill."""
    written, left = [], []

    def write(self, block, write=Writer.write):
        if len(written) == blocks:
            left.append(path.read_bytes())
            raise KeyboardInterrupt
        written.append(block.index)
        write(self, block)

    with patch.context() as m:
        m.setattr(Writer, "write", write)
        with pytest.raises(KeyboardInterrupt):
            sweep(name, path)
    if killed:
        path.write_bytes(*left)


@each
def test_file_equals_memory(name, whole, run):
    assert run("info", str(whole), "--check", "--json")[0] == 0
    loaded, now = vd.load(whole), sweep(name)
    assert len(look(whole).done) == 7
    assert same(loaded, now)
    assert loaded.record == now.record
    assert repr(loaded) == repr(now)


@each
def test_killed_interrupted_and_resumed_equals_uninterrupted(name, whole, tmp_path, monkeypatch):
    path = tmp_path / "part.h5"
    for blocks, killed in ((0, True), (3, False), (2, True)):
        interrupt(name, path, blocks, monkeypatch, killed)
    assert vd.load(path).computed == pytest.approx(5 / 7)
    sweep(name, path)
    assert path.read_bytes() == whole.read_bytes()


DAMAGES = {
    "a flipped bit": lambda own, other: own[:-1] + bytes([own[-1] ^ 4]),
    "zeros": lambda own, other: bytes(len(own)),
    "another block": lambda own, other: other,
}


@each
@pytest.mark.parametrize("damage", DAMAGES)
def test_damaged_blocks_are_seen_and_computed_again(name, damage, whole, run):
    """Each variable is damaged in another block. Its array lacks this block, and all others are read as before.

    The last of the seven blocks is always sound.
    """
    sound, before = whole.read_bytes(), arrays(vd.load(whole))
    rows = variables_of(vd.load(whole).plan)
    variables = [v.variable for v in rows]
    array_of = {v.variable: "section" if v.along == "period" else v.name for v in rows}
    with h5py.File(whole) as file:
        places = {v: (file[v].id.get_offset(), file[v].id.get_storage_size() // 7) for v in variables}
    for some in (variables[k : k + 6] for k in range(0, len(variables), 6)):
        raw = bytearray(sound)
        for block, variable in enumerate(some):
            at, size = places[variable]
            own, other = (sound[at + k * size : at + (k + 1) * size] for k in (block, block + 1))
            wrong = (DAMAGES[each](own, other) for each in (damage, "a flipped bit"))  # values may be zero, or equal
            raw[at + block * size : at + (block + 1) * size] = next(one for one in wrong if one != own)
        whole.write_bytes(raw)
        code, _, err = run("info", str(whole), "--check")
        assert code == 1
        assert all(f"{v}: does not match its digest" in err for v in some)
        again = f"the call in Python, vd.sweep(…, record={TOLD[name]}, path=…)," if name in FUNCTIONS else "the sweep"
        assert err.count(f". Repeat {again} to compute this block again\n") == len(some)
        told = r"left out of \w+: block \d \(points \d+ to \d+: A = .*\. Repeat "
        with pytest.warns(DamagedBlock, match=told + re.escape(f"{again} to compute them again")):
            found = arrays(vd.load(whole))
        lost = found["status"] == vd.Status.NOT_COMPUTED
        assert np.argwhere(lost)[:, 0].tolist() == [block for block in range(len(some)) for _ in range(2)]
        for n, values in found.items():
            for block, variable in enumerate(some):
                here = values[block]
                if variable == "status" or n in (array_of[variable], "status"):
                    assert (np.isnan(here) if here.dtype.kind == "f" else here == -1).all(), (n, variable)
                else:
                    assert here.tobytes() == before[n][block].tobytes(), (n, variable)
        assert sweep(name, whole).computed == 1.0
        assert whole.read_bytes() == sound


@each
def test_command_line_continues_a_call(name, whole, tmp_path, monkeypatch, run):
    path = tmp_path / "part.h5"
    interrupt(name, path, 3, monkeypatch)
    with h5py.File(path) as file:
        (tmp_path / "made.toml").write_bytes(file.attrs["config"])
    code, _, err = run("sweep", str(tmp_path / "made.toml"), "-o", str(path))
    if name in FUNCTIONS:
        assert code == 2
        assert "only a call of vd.sweep has functions" in err
        assert f"\nresume    repeat the call in Python, vd.sweep(…, record={TOLD[name]}, path=…)\n" in info(run, path)
        assert vd.load(path).computed == pytest.approx(3 / 7)
    else:
        assert code == 0
        assert path.read_bytes() == whole.read_bytes()
        assert "resume" not in info(run, path)


REWRITES = {name: functools.partial(rewrite, form=form) for name, form in FORMS.items()} | {
    f"xarray, {engine}, {decoded}": functools.partial(save_by_xarray, engine=engine, decoded=decoded)
    for engine, decoded in (("h5netcdf", True), ("netcdf4", True), ("netcdf4", False))
}


@each
def test_unfinished_file_of_another_program_is_read_and_continued_or_left_alone(name, whole, tmp_path, monkeypatch):
    """It is continued if each of its variables is one piece.

    All ways to write a file anew are tried with one record, and one way of each kind with the others.
    """
    part, path = tmp_path / "part.h5", tmp_path / "theirs.h5"
    interrupt(name, part, 3, monkeypatch)
    for how in REWRITES if name == ALL else ("h5repack -l CHUNK", "xarray, h5netcdf, True"):
        REWRITES[how](part, path)
        before = path.read_bytes()
        assert same(vd.load(path), vd.load(part)), how
        assert (verify(path).complaints(), vd.load(path).title) == ([], vd.load(part).title), how
        assert vd.load(path).computed == look(path).share == pytest.approx(3 / 7), how
        if how not in CHUNKED:
            assert same(sweep(name, path), vd.load(whole)), how
            assert verify(path).sound, how
        else:
            with pytest.raises(NoResult, match=r"rewritten by another program .* it cannot be resumed"):
                sweep(name, path)
            assert path.read_bytes() == before, how


def info(run, path):
    code, out, _ = run("info", str(path))
    assert code == 0
    return out


class Counting(ThreadPoolExecutor):
    """Threads that note their tasks."""

    def __init__(self, threads):
        super().__init__(threads)
        self.tasks = []

    def submit(self, task, *arguments):
        self.tasks.append(task)
        return super().submit(task, *arguments)


@each
def test_threads_and_executor_give_the_same_bits(name, whole, tmp_path, monkeypatch):
    monkeypatch.setattr("vibrodrive.batch.sweep.BRIEF", 0.0)  # otherwise so little work would start no thread
    with Counting(2) as executor:
        for options in ({"threads": 1}, {"threads": 2}, {"executor": executor}):
            assert same(vd.load(whole), sweep(name, **options)), options
        in_memory = len(executor.tasks)
        sweep(name, tmp_path / "pool.h5", executor=executor)
    assert 0 < in_memory < len(executor.tasks)
    assert (tmp_path / "pool.h5").read_bytes() == whole.read_bytes()


@each
def test_pickle_copy_and_selection_keep_the_numbers(name, whole, monkeypatch):
    """A pickle of a file reads it, wherever it was named from."""
    monkeypatch.chdir(whole.parent)
    loaded, now = vd.load(whole.name), sweep(name)
    packed, part = pickle.dumps(loaded), now.select(B=0.12)
    monkeypatch.chdir("/")
    assert len(packed) < whole.stat().st_size / 4
    for other in (pickle.loads(packed), copy.copy(loaded), pickle.loads(pickle.dumps(now))):
        assert same(loaded, other)
        assert (other.record, repr(other)) == (loaded.record, repr(loaded))
    assert len(pickle.dumps(part)) < len(pickle.dumps(now)), "a selection contains its own data only"
    for each in (vd.load(whole).select(B=0.12), pickle.loads(pickle.dumps(part)), copy.deepcopy(part)):
        for n, values in arrays(each).items():
            assert np.array_equal(values, arrays(loaded)[n][:, 1], equal_nan=True)


@each
@pytest.mark.parametrize("engine", ["h5netcdf", "netcdf4"])
def test_file_dataset_and_table_have_the_same_numbers(name, engine, whole):
    loaded = vd.load(whole)
    data, table = loaded.to_xarray(), loaded.to_dataframe()
    assert table["A"].tolist() == np.repeat(loaded.axes["A"], 2).tolist()
    assert table["status"].tolist() == [str(status) for status in loaded.status.ravel()]
    numbers = {"period" if n == "motion_period" else n for n, array in data.data_vars.items() if array.ndim == 2}
    assert {*table} == {*table.attrs["units"]} == {"A", "B", *numbers}
    with xr.open_dataset(whole, engine=engine, decode_cf=False) as file:
        assert {*file.data_vars} == {*data.data_vars}
        for n, array in data.data_vars.items():
            assert array.dims == file[n].dims
            assert np.asarray(array).tobytes() == file[n].to_numpy().tobytes(), n
            if array.dims == ("A", "B"):
                column = table["period" if n == "motion_period" else n]
                assert "flag_values" in array.attrs or np.array_equal(column, array.to_numpy().ravel(), equal_nan=True)


@each
def test_default_figure_is_drawn_from_memory_and_file(name, whole, run):
    vd.load(whole).plot()
    assert run("plot", str(whole))[0] == 0
    assert whole.with_suffix(".png").exists() or Path("whole.png").exists()


@pytest.mark.slow("40 s: processes that load the kernels, and a cluster")
def test_processes_and_dask_give_the_same_bits(tmp_path):
    distributed = pytest.importorskip("distributed")
    (tmp_path / "whole").mkdir()
    with (
        ProcessPoolExecutor(1, mp_context=get_context("spawn")) as processes,
        distributed.Client(n_workers=1, threads_per_worker=1, dashboard_address=None) as client,
    ):
        for name in CASES:
            uninterrupted(name, tmp_path / "whole")
            for executor in (processes, client.get_executor()):
                assert same(vd.load(tmp_path / "whole" / f"{name}.h5"), sweep(name, executor=executor))


@pytest.mark.slow("10 s: a process that compiles the kernels of a sweep, unless they are on disk")
def test_worker_that_compiles_helps_one_with_the_code_of_the_package(tmp_path, monkeypatch):
    """Both have the same sources, and so the same bits. Without machine code of the package, both compile."""
    (tmp_path / "whole").mkdir()
    wanted = uninterrupted("section", tmp_path / "whole")
    monkeypatch.setenv("VIBRODRIVE_CODE", "numba")  # for processes that start from now on
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as processes:
        assert processes.submit(code_of_kernels).result() == "compiled"
        sweep("section", tmp_path / "x.h5", executor=processes)
    assert (tmp_path / "x.h5").read_bytes() == wanted


def code_of_kernels():
    from vibrodrive.explorer.density import darken

    return "of the package" if darken.shipped else "compiled"
