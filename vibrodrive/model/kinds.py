"""Kinds of result files, and the functions of higher layers that lower layers call.

A place is the text "module:name" of an object below `vibrodrive`. The module is imported on first use. So a command
loads only the modules that it needs, and no layer imports a higher layer. tests/store/test_every_kind.py imports all
places.
"""

from collections.abc import Mapping
from importlib import import_module
from typing import Any, NamedTuple

from vibrodrive.model.drawing import (
    DIAGRAM_QUANTITIES,
    FIGURE_KINDS,
    FIGURE_UNITS,
    K2,
    MAP,
    MAP_QUANTITIES,
    SECTION_QUANTITIES,
)


class Kind(NamedTuple):
    """A kind of result file.

    Attributes
    ----------
    holds
        contents, in a few words.
    command
        command that writes it.
    reader
        place of the function that reads an open file into the object that `load` returns. For the kind "switches" the
        function returns the object that `info` describes.
    words
        texts that identify a damaged file of this kind. Every file of this kind contains them, some near its
        beginning, and hardly any other file contains them.
    schema
        root attribute with the number of the schema; "" if there is none.
    readable
        numbers of the schemas that this version reads.
    faults
        place of the function that returns contradictions between an open file and the object read from it.
    recipe
        place of the Recipe with which `jobs.runner` makes the file.
    figures
        endings of the names of the figures that the command draws.
    options
        values allowed for the options of `plot`; None for a kind that can neither be loaded nor drawn.
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
        options={"kind": FIGURE_KINDS, "quantity": (*DIAGRAM_QUANTITIES, *MAP_QUANTITIES), "units": FIGURE_UNITS},
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
"""Kinds of files. The key is the value of the root attribute `kind` of the file."""

ABOVE = {
    "a Dataset of results": "store.dataset:dataset",
    "the figure of results": "figures.diagrams:from_results",
    "the figure of a motion": "figures.curves:trajectory_figure",
    "the figure of limits": "figures.limits:limits_figure",
    "the map of limits": "figures.limits:limits_map",
    "the figure of failures": "figures.failures:failures_figure",
    "the figure of orbits": "jobs.orbits:drawn",
    "the figure of curves": "figures.plane:curves_figure",
    "the progress of a call": "jobs.progress:under_way",
}
"""Places of functions of higher layers that lower layers call. The key is the argument of `above`."""


def named(place: str) -> Any:
    """Import the object at a place."""
    module, _, name = place.partition(":")
    return getattr(import_module(f"vibrodrive.{module}"), name)


def above(what: str) -> Any:
    """Import the object of an entry of ABOVE."""
    return named(ABOVE[what])
