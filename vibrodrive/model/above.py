"""Functions of higher layers that lower layers call, for methods such as `Results.plot`.

No layer imports a higher layer. These functions are imported on first use, so that a command loads only what it needs:
mainly Matplotlib comes late. A test imports all of them.
"""

from importlib import import_module
from typing import Any

ABOVE = {
    "a Dataset of results": "store.dataset:dataset",
    "a table of results": "store.dataset:frame",
    "the figure of results": "figures.diagrams:from_results",
    "the figure of a motion": "figures.curves:trajectory_figure",
    "blocks of points": "stability.per_point:take_in_turn",
    "blocks of limits": "stability.per_point:find_limits",
    "blocks of impulses": "stability.per_point:find_impulses",
    "blocks of proofs": "stability.per_point:find_proofs",
    "the failures of a motion": "stability.failures:count_failures",
    "the gaps of undisturbed motions": "jobs.maps:undisturbed_gaps",
    "the progress of a call": "jobs.progress:under_way",
}
"""Places "module:name" below `vibrodrive`. The key is the argument of `above`."""


def above(entry: str) -> Any:
    """Import the object of an entry of ABOVE."""
    module, _, name = ABOVE[entry].partition(":")
    return getattr(import_module(f"vibrodrive.{module}"), name)
