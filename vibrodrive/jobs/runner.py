"""Compute the result file of a configuration, for all kinds of files except sweeps. Each kind has a Recipe."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from vibrodrive.batch.sweep import check_threads
from vibrodrive.model.config import Config
from vibrodrive.model.kinds import FILES, named
from vibrodrive.model.plan import Plan
from vibrodrive.store.every_kind import load
from vibrodrive.store.file import is_computed
from vibrodrive.store.layout import Progress, quiet

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Work(NamedTuple):
    """A computation: configuration, file and options.

    `own` contains the settings of the command, by the names of root attributes. If `resume` is True, an existing file
    is resumed, otherwise it is replaced.
    """

    config: Config
    plan: Plan
    own: Mapping[str, Any]
    path: Path
    progress: Progress
    threads: int | None
    resume: bool


class Recipe(NamedTuple):
    """Functions that make and show the files of one kind.

    Attributes
    ----------
    check
        function that is called before a file is made. It returns the settings of the command, or raises TypeError or
        ValueError with one sentence.
    make
        function that computes the file. It returns True if anything had to be computed.
    figures
        function of the contents of the file and the number of threads that returns the figures, in the order of
        `Kind.figures`.
    table
        function that returns the output of the command as text; "" for no output.
    listed
        function that returns the output of the command for `--json`.
    partial
        True if `make` can complete a partial file. If it is False, the file is written in one step.
    """

    check: Callable[[Config, Plan], dict[str, Any]]
    make: Callable[[Work], bool]
    figures: Callable[[Any, int | None], list[Figure]]
    table: Callable[[Any], str]
    listed: Callable[[Any], dict[str, Any]]
    partial: bool = False


def recipe_of(kind: str) -> Recipe:
    """Return the recipe of a kind of file."""
    found: Recipe = named(FILES[kind].recipe)
    return found


def run(
    kind: str,
    config: Config,
    out: str | Path,
    progress: Progress = quiet,
    *,
    threads: int | None = None,
    overwrite: bool = False,
) -> tuple[Any, bool]:
    """Compute the result of a configuration into a file. An existing file of the same configuration is resumed.

    Returns (contents of the file as by `load`, True if anything had to be computed). With `overwrite` an existing
    result file is replaced when the new file is complete or laid out. Raises the TypeError or ValueError of the check
    of the recipe before a file is made, and Different, NoResult, Busy or OSError if the file cannot be resumed or
    written.
    """
    recipe, plan, path = recipe_of(kind), config.plan(), Path(out)
    check_threads(threads)
    own = recipe.check(config, plan)
    resume = path.exists() and not overwrite
    if not recipe.partial and resume and is_computed(path, kind, plan, own):
        return load(path), False
    computed = recipe.make(Work(config, plan, own, path, progress, threads, resume))
    return load(path), computed
