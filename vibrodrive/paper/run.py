"""Recompute the paper: draw each figure from its configuration, and test each claim on the results."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from vibrodrive.figures.style import drawn_as, save
from vibrodrive.model.packaged import configurations
from vibrodrive.model.parameters import bad
from vibrodrive.paper import (  # noqa: F401 (their import registers the claims)
    claims_grid,
    claims_limits,
    claims_physical,
    claims_switches,
    claims_undisturbed,
)
from vibrodrive.paper.claim import CLAIMS, claims_page, judge
from vibrodrive.paper.figures import FIGURES
from vibrodrive.paper.session import Say, Session
from vibrodrive.store.place import check_place, make_directory, refuse_foreign
from vibrodrive.verdicts import Judged, write
from vibrodrive.version import __version__

SUBJECTS = (*FIGURES, "limits")
"""Values of the argument `figures`: the names of the drawings, and "limits" for claims that have no figure."""


class Paper(NamedTuple):
    """Result of `run_paper`: the written files and the judged claims."""

    files: list[Path]
    claims: list[Judged]


def _prepare(folder: Path) -> None:
    """Create the directory. Raises ValueError if it contains a file that must not be replaced, or OSError."""
    make_directory(folder)
    computed = [
        f"{path.stem}{ending}" for path in configurations().glob("*.toml") for ending in (".h5", "_switches.h5")
    ]
    drawn = [f"{name}{ending}" for name in FIGURES for ending in (".png", ".pdf")]
    for name in (*computed, *drawn, "claims.json", "claims.md"):
        check_place("output", folder / name, renamed=True)
        if name in computed:
            refuse_foreign(folder / name)


def run_paper(
    out: str | Path, figures: Sequence[str] | None = None, progress: Say | None = None, threads: int | None = None
) -> Paper:
    """Recompute the paper into a directory: NAME.png, NAME.pdf, NAME.h5, claims.json and claims.md.

    Parameters
    ----------
    out : path
        directory; it is created if missing. Files of an earlier run are replaced. A file with the name of a result file
        that vibrodrive has not written is not replaced.
    figures : sequence of str, optional
        names of drawings (see figures.FIGURES), and "limits" for the claims about limits; by default all. Only claims
        about these figures are tested.
    progress : callable, optional
        function that is called at each step with one line of text.
    threads : int, optional
        number of threads; by default the number of threads of Numba.

    Returns
    -------
    Paper
        `files` lists the paths of the files written, and `claims` the judged claims.

    Raises
    ------
    ValueError
        if a figure is unknown, or if a file must not be replaced.
    OSError
        if the system refuses to read or write a file.
    """
    names = list(SUBJECTS) if figures is None else list(figures)
    for name in names:
        if name not in SUBJECTS:
            raise ValueError(bad("figure", name, "one of " + ", ".join(SUBJECTS)))
    say = progress or (lambda line: None)
    folder = Path(out)
    _prepare(folder)
    session = Session(configurations(), folder, say, threads)
    for name in (n for n in names if n in FIGURES):
        say(f"{name}: {FIGURES[name].title}")
        with drawn_as("print", "double"):
            drawn = FIGURES[name].draw(session)
        session.files += [save(drawn, folder / f"{name}{ending}") for ending in (".png", ".pdf")]
    judged = []
    for claim in sorted((c for c in CLAIMS if c.figure in names), key=lambda c: SUBJECTS.index(c.figure)):
        say(f"claim {claim.id}")
        judged.append(judge(claim, session))
    document = {"vibrodrive": __version__, "claims": [j.document() for j in judged]}
    session.files += write(folder, "claims", document, claims_page(judged))
    return Paper(session.files, judged)
