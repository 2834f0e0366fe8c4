"""Kinds of result files, each once, and the places at which lower floors call higher ones.

A place is "module:name" below `vibrodrive`. It is imported when it is needed: a command loads no more than it uses, and
no floor imports one above it. tests/store/test_every_kind.py resolves all of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Any, NamedTuple

from vibrodrive.model.drawing import DIAGRAM_QUANTITIES, FIGURE_KINDS, K2, MAP, MAP_QUANTITIES, SECTION_QUANTITIES


class Kind(NamedTuple):
    """A kind of result file.

    Attributes
    ----------
    holds
        its contents, in a few words.
    command
        the command that makes it.
    reader
        place of a function of an open file, which returns the object that `load` does (of switches: `info`).
    words
        that lie as text in each such file, some near its beginning, and hardly in a file of another program.
    schema, readable
        root attribute with the number of its schema, where it has one, and the numbers that this version reads.
    faults
        place of a function of an open file and that object, which returns contradictions between them.
    recipe
        place of the Recipe from which `jobs.runner` makes it.
    figures
        endings of the names of the figures that its command draws.
    options
        what can be asked of its figure, by option of `plot`; None for a kind that is neither loaded nor drawn.
    """

    holds: str
    command: str
    reader: str
    words: tuple[str, ...]
    schema: str = ""
    readable: tuple[int, ...] = ()
    faults: str = ""
    recipe: str = ""
    figures: tuple[str, ...] = ("",)
    options: Mapping[str, tuple[str, ...]] | None = None


FILES = {
    "sweep": Kind(
        holds="a sweep",
        command="sweep",
        reader="store.reader:read",
        words=("recorded excitation period", "section_xi", "section_dxi"),
        schema="schema_version",
        readable=(3,),
        options={"kind": FIGURE_KINDS, "quantity": (*DIAGRAM_QUANTITIES, *MAP_QUANTITIES)},
    ),
    "limits": Kind(
        holds="limits of stability",
        command="limits",
        reader="store.limits:read",
        words=("searched_to",),
        schema="limits_schema",
        readable=(2, 3),
        faults="store.limits:faults",
        recipe="jobs.limits:RECIPE",
        options={"kind": (MAP,), "quantity": (K2,)},
    ),
    "failures": Kind(
        holds="failures of methods",
        command="failures",
        reader="store.failures:read",
        words=("judged",),
        faults="store.failures:faults",
        recipe="jobs.failures:RECIPE",
        options={},
    ),
    "orbits": Kind(
        holds="periodic orbits",
        command="orbits",
        reader="store.orbits:read",
        words=("bifurcation_A", "first_impact"),
        schema="schema_version",
        readable=(1,),
        faults="store.orbits:faults",
        recipe="jobs.orbits:RECIPE",
        figures=("", "_multipliers"),
        options={"kind": ("bifurcation", "multipliers"), "quantity": SECTION_QUANTITIES},
    ),
    "curves": Kind(
        holds="curves of bifurcations",
        command="orbits",
        reader="store.curves:read",
        words=("meeting_A",),
        schema="schema_version",
        readable=(1,),
        faults="store.curves:faults",
        recipe="jobs.curves:RECIPE",
        options={},
    ),
    "switches": Kind("switches of single motions", "paper", "store.switches:read", ("motion_0",)),
}
"""By the root attribute `kind` of the file."""

ABOVE = {
    "a Dataset of results": "store.dataset:dataset",
    "the figure of results": "figures.diagrams:from_results",
    "the figure of a motion": "figures.curves:trajectory_figure",
    "the figure of limits": "figures.limits:limits_figure",
    "the map of limits": "figures.limits:limits_map",
    "the figure of failures": "figures.failures:failures_figure",
    "the figure of orbits": "jobs.orbits:drawn",
    "the figure of curves": "figures.plane:curves_figure",
    "a line while it lasts": "jobs.progress:under_way",
}
"""What methods and functions call above their own floor."""


def named(place: str) -> Any:
    """Import what stands at a place."""
    module, _, name = place.partition(":")
    return getattr(import_module(f"vibrodrive.{module}"), name)


def above(what: str) -> Any:
    """Import one of ABOVE."""
    return named(ABOVE[what])
