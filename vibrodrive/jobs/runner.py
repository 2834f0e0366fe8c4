"""From a configuration to a result file of a kind other than sweeps: one road for all, a Recipe for what differs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from vibrodrive.batch.sweep import check_threads
from vibrodrive.model.config import Config
from vibrodrive.model.kinds import FILES, named
from vibrodrive.model.plan import Plan
from vibrodrive.store.every_kind import load
from vibrodrive.store.file import made_already
from vibrodrive.store.layout import Origin, Progress, quiet

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Work(NamedTuple):
    """A computation: from which configuration, into which file.

    `own` are the settings of the command, by the names of root attributes. With `resume` the file that is there is
    resumed, otherwise it is replaced.
    """

    config: Config
    plan: Plan
    own: Mapping[str, Any]
    path: Path
    progress: Progress
    threads: int | None
    resume: bool

    def origin(self, title: str) -> Origin:
        """Return where the file comes from, for the file. `title` is used if the configuration has none."""
        return Origin(self.config.text, self.config.overrides, self.config.title or title)


class Recipe(NamedTuple):
    """How a kind of file is made and shown.

    Attributes
    ----------
    check
        called before a file is made: returns the command's own settings. Raises TypeError or ValueError with one
        sentence naming the key, the value and what is allowed.
    make
        computes into the file; returns whether anything had to be computed.
    figures
        draws what the file holds, with so many threads, for the endings in `Kind.figures`.
    table, listed
        returns what the command prints: text, "" for nothing, or facts for `--json`.
    partial
        whether a file may be there in part, which `make` completes. Others are written in one go.
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
    """Compute what a configuration asks for into a file; resume one that is there and was made from the same.

    Returns the contents of the file, as `load` does, and whether anything had to be computed. With `overwrite` a result
    file that is there is replaced, once the new one is whole or laid out. Raises what the recipe refuses, before a file
    is made; Different, NoResult, Busy or OSError if the file cannot be resumed or written.
    """
    recipe, plan, path = recipe_of(kind), config.plan(), Path(out)
    check_threads(threads)
    own = recipe.check(config, plan)
    resume = path.exists() and not overwrite
    if not recipe.partial and resume and made_already(path, kind, plan, own):
        return load(path), False
    computed = recipe.make(Work(config, plan, own, path, progress, threads, resume))
    return load(path), computed
