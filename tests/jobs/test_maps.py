"""A map of `kept` shows where a motion has the gaps (periods between main impacts) of the undisturbed motion.

Limits and bifurcations can be drawn over a map.
"""

import numpy as np
import pandas as pd
import pytest

import vibrodrive as vd
from tests.support import fake
from vibrodrive.batch.block import gather
from vibrodrive.batch.sweep import run_blocks
from vibrodrive.errors import ConfigError
from vibrodrive.figures.map import map_figure
from vibrodrive.figures.plane import Exact, read_lines
from vibrodrive.jit.slices import Halt
from vibrodrive.jobs.maps import undisturbed_gaps
from vibrodrive.model.plan import make_plan
from vibrodrive.stability.evaluate import Evaluator
from vibrodrive.stability.structure import ReferenceOrbit


@pytest.mark.jit
def test_undisturbed_gaps_equal_the_cycle_of_limits():
    A = np.array([1.05, 1.5, 2.65, 2.8, 3.04, 3.1666, 3.22])
    swept = vd.sweep(A=A, eps=[1e-5, 1e-2], tau0=[0.0, 1.0], transient=10, periods=10, record="summary")
    found = undisturbed_gaps(swept)
    assert found.shape == (len(A), 1, 2)
    with Evaluator(make_plan({"A": A}), "eps", 1, Halt()) as evaluator:
        orbits = evaluator.undisturbed(np.arange(len(A)))
    for gaps, orbit in zip(found[:, 0, 0].tolist(), orbits, strict=True):
        if not isinstance(orbit, ReferenceOrbit) or orbit.cycle is None:
            assert gaps == 0
        else:
            cycle = orbit.cycle.gaps.tolist()
            least = min("".join(map(str, cycle[k:] + cycle[:k])) for k in range(len(cycle)))
            # after a period doubling the cycle of gaps may be shorter than the cycle of impacts
            assert least == str(gaps) * (len(least) // len(str(gaps)))


@pytest.mark.jit
def test_undisturbed_motion_has_settled():
    """From rest this motion needs more than 500 periods until each impact follows after 6 periods."""
    point = {"A": 2.8722, "B": 0.024}
    swept = vd.sweep(**{**point, "A": [2.8722]}, eps=[1e-5], transient=10, periods=10, record="summary")
    assert undisturbed_gaps(swept).tolist() == [[6]]
    together = vd.sweep(**point, points={"eps": [1e-5, 2e-5]}, transient=10, periods=10, record="summary")
    assert undisturbed_gaps(together).tolist() == [6]
    assert np.unique(np.diff(vd.simulate(**point, transient=20_000, periods=60).impacts["period"])).tolist() == [6]


@pytest.mark.jit
def test_structure_is_lost_at_the_limit():
    """The gaps in a summary equal the undisturbed gaps at three values of ε below k₂, and differ from them at k₂.

    `vd.limit` finds k₂ independently of the summary, from recorded main impacts.
    """
    for A in (1.5, 2.5, 2.8):
        k2 = vd.limit(A, transient=100, periods=200).k2
        eps = k2 * np.array([0.3, 0.9, 0.97, 1.0])
        swept = vd.sweep(A=[A], eps=eps, transient=100, periods=200, record="summary")
        gaps = undisturbed_gaps(swept)
        assert (swept.gaps == gaps).tolist() == [[True, True, True, False]]
        image = map_figure(swept, "kept", x="A", undisturbed=gaps).axes[0].images[0].get_array()
        assert [np.unique(row).size for row in np.asarray(image)] == [1] * len(image)
        assert np.array_equal(image, swept.plot(quantity="kept", x="A").axes[0].images[0].get_array())
        assert np.unique(image).size == 2


@pytest.mark.jit
def test_nothing_is_lost_without_a_disturbance_on_axes_of_a_scene():
    scene = {"omega0": np.linspace(100.0, 160.0, 4), "a0": np.array([0.6e-3, 0.8e-3]), "mu": 0.6, "alpha": 3.4}
    plan = make_plan({**scene, "transient": 500, "periods": 64, "record": "summary"})
    swept = gather(plan, run_blocks(plan))
    assert (undisturbed_gaps(swept) == swept.gaps).all()
    assert len(np.unique(swept.gaps)) > 2


def test_only_limits_and_bifurcations_are_drawn_over_a_map(tmp_path):
    fake.write(tmp_path / "limits.h5", "[sweep]\nA = [2.5, 2.8]\n[run]\nrecord = 'limit'\n")
    fake.write(tmp_path / "summary.h5", "[sweep]\nA = [2.5, 2.8]\n[run]\nrecord = 'summary'\nperiods = 1\n")
    orbit, fold = "stable orbit,2.5,0.1,1,1,-0.9,,,0.56,1.3,UP", "fold,3.19,0.1,3,2,,,,0.5,1.1,UP"
    names = "kind,A,B,period,impacts,multiplier,multiplier_below,multiplier_above,phase,speed,word"
    (tmp_path / "orbits.csv").write_text("\n".join([names, orbit, fold]))
    (tmp_path / "other.csv").write_text("A,B\n2.5,0.1\n")
    limits, bifurcation = read_lines([tmp_path / "limits.h5", tmp_path / "orbits.csv"])
    assert limits.k2.shape == (2,)
    assert bifurcation == Exact("fold", 3, 2, 3.19, 0.1)
    assert read_lines(pd.read_csv(tmp_path / "orbits.csv")) == read_lines(str(tmp_path / "orbits.csv")) == [bifurcation]
    for other in (3, [3], vd.load(tmp_path / "summary.h5"), pd.DataFrame({"A": [2.5]})):
        with pytest.raises(ValueError, match=r"^over = .*: must be limits \(record"):
            read_lines(other)
    for name, words in (("summary.h5", 'record = "limit"'), ("other.csv", "a table of `vibrodrive orbits")):
        with pytest.raises(ValueError, match=f"over = '.*must be .*{words}"):
            read_lines([tmp_path / name])
    assert read_lines([]) == []
    table = (tmp_path / "orbits.csv").read_bytes()
    (tmp_path / "other.csv").write_bytes(table.replace(b",", b";"))
    with pytest.raises(ConfigError, match=r"other.csv: separator = ';': must be a comma"):
        read_lines([tmp_path / "other.csv"])
    (tmp_path / "other.csv").write_bytes(b"\xef\xbb\xbf" + table.replace(b"\n", b"\r\n") + b"\r\n\r\n")
    assert read_lines([tmp_path / "other.csv"]) == [bifurcation], "as a spreadsheet writes it"
