"""Summary of NAME_switches.h5, a file in which `vibrodrive paper` stores the switches of single motions.

`vibrodrive info` prints the summary.
"""

from dataclasses import dataclass
from typing import Any

import h5py

from vibrodrive.model.described import Stored


@dataclass(frozen=True, repr=False)
class StoredSwitches(Stored):
    """Motions by name, each with its A and its numbers of switches and section points."""

    file_kind = "switches"

    motions: dict[str, dict[str, int | float]]
    title: str = ""

    def facts(self) -> dict[str, Any]:
        return {"motions": self.motions}


def read(file: h5py.File) -> StoredSwitches:
    motions = {
        name: {"switches": len(group["switches"]), "periods": len(group["section"]), "A": float(group.attrs["A"])}
        for name, group in file.items()
    }
    return StoredSwitches(motions, str(file.attrs["title"]))
