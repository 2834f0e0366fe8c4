"""Commands compute, describe, draw or refuse sweeps with parameters that change together."""

from pathlib import Path

import pytest

TEXT = """
[sweep]
[sweep.points]
A = {start = 3.0, stop = 3.2, num = 14}
xi0 = {start = 0, stop = 8, num = 14}
[run]
transient = 2
periods = 3
[figure]
x = "A"
"""


@pytest.mark.jit
def test_commands_compute_describe_draw_or_refuse(run):
    Path("p.toml").write_text(TEXT)

    assert run("sweep", "p.toml", "--plot")[0] == 0
    assert Path("p.png").exists()
    assert "nothing to compute" in run("sweep", "p.toml")[2]
    told = run("info", "p.h5")[1]
    assert "axis      point = 0 to 13, 14 values\npoint     A between 3 and 3.2\npoint     xi0 between " in told
    assert run("info", "--check", "p.h5")[0] == 0
    assert run("sweep", "p.toml", "--dry-run")[0] == 0
    code, _, err = run("trajectory", "p.toml")
    assert code == 2
    assert err.endswith("sweep.points = 14 points: must be one point (lists with one value)\n")
