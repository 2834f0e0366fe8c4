"""Level 4 of the set: the orbits of 16 pairs (A, B), and the disturbances at which the main impacts lose their order or
their gaps, the numbers of periods between them.

python -m benchmarks.switches.level4    # writes level4.csv in a minute or two
"""

import csv
from collections.abc import Iterator
from pathlib import Path

import vibrodrive as vd
from vibrodrive.stability.limit import LimitSearch, plan_limits
from vibrodrive.stability.structure import SETTLING, WATCHED, reference_orbit

SCENES = [(A, 0.1) for A in (1.3, 1.5, 2.4, 2.65, 2.7, 2.75, 3.04, 3.1, 3.15, 3.17, 3.2, 3.25)]
SCENES += [(2.8, 0.05), (2.8, 0.2), (3.04, 0.05), (3.04, 0.4)]
WAYS = (("eps", "certified"), ("dtau", "fixed"), ("dtau", "muller"))
RECORD = {"transient": 1000, "periods": 1500}
TABLE = Path(__file__).with_name("level4.csv")
ORBIT = ["A", "B", "n", "gaps", "phases", "speeds"]
HEAD = [*ORBIT, "disturbance", "method", "first_lost", "last_kept", "share_kept", "searched_to"]


def rows(A: float, B: float) -> Iterator[list[str]]:
    """Yield a row for each disturbance and method: the orbit for (A, B), and the band of its limit (README.md)."""
    orbit = reference_orbit(vd.simulate(A, B=B, transient=SETTLING, periods=WATCHED))
    if orbit is None or orbit.cycle is None:
        raise ValueError(f"A = {A}, B = {B}: no periodic orbit with impacts")
    cycle = orbit.cycle
    lists = [" ".join(f"{x:.6g}" for x in column) for column in (cycle.gaps, cycle.phase, cycle.speed)]
    for disturbance, method in WAYS:
        ((_, band),) = LimitSearch(plan_limits({"A": A, "B": B, **RECORD}, disturbance, method)).run()
        ends = (band.k2, band.last_kept, band.share_kept, band.searched_to)
        yield [f"{A:g}", f"{B:g}", str(orbit.n), *lists, disturbance, method, *(f"{x:.6g}" for x in ends)]


def main() -> None:
    """Compute all rows and write the table."""
    with TABLE.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(HEAD)
        writer.writerows(row for scene in SCENES for row in rows(*scene))


if __name__ == "__main__":
    main()
