"""Tests of level 4 of the set of switches, a table of limits k₂ (benchmarks/switches/level4.py)."""

import csv
import math

import numpy as np
import pytest

import vibrodrive as vd
from benchmarks.switches import level4


@pytest.fixture(scope="module")
def table():
    with level4.TABLE.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_every_scene_has_a_row_for_each_disturbance(table):
    found = [(float(row["A"]), float(row["B"]), row["disturbance"], row["method"]) for row in table]
    assert found == [(*scene, *way) for scene in level4.SCENES for way in level4.WAYS]
    for row in table:
        gaps, phases, speeds = (row[name].split() for name in ("gaps", "phases", "speeds"))
        assert sum(map(int, gaps)) == int(row["n"])
        assert len(gaps) == len(phases) == len(speeds)


@pytest.mark.jit
def test_scene_is_reproduced_to_the_byte(table):
    fresh = [dict(zip(level4.HEAD, row, strict=True)) for row in level4.rows(3.04, 0.1)]
    assert fresh == [row for row in table if (row["A"], row["B"]) == ("3.04", "0.1")]


@pytest.mark.jit
@pytest.mark.parametrize("way", ["eps", "dtau"])
def test_gaps_are_kept_below_the_limit_only(table, way):
    """Fast impacts are selected without the criterion of the package: one in every second period, so every gap is 2."""
    row = next(r for r in table if (r["A"], r["B"], r["disturbance"]) == ("3.04", "0.1", way))

    def gaps(value):
        method = {"eps": value} if way == "eps" else {"dtau": value, "method": "fixed"}
        switches = vd.simulate(3.04, **level4.RECORD, **method).switches
        fast = switches[(switches["after"] == vd.State.IMPACT) & (switches["dxi"] < -0.1 * float(row["speeds"]))]
        tau = 2 * math.pi * fast["period"] + fast["phase"]
        apart = np.rint(np.diff(tau) / (2 * math.pi))
        return set(apart[apart > 0].tolist())

    assert gaps(0.99 * float(row["first_lost"])) == {2.0}
    assert gaps(1.2 * max(float(row["first_lost"]), float(row["last_kept"]))) != {2.0}
