"""The paper, recomputed: every figure from its own configuration, every claim held against the result."""

from __future__ import annotations

import errno
import json
import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from vibrodrive import __version__
from vibrodrive.batch.sweep import run_blocks
from vibrodrive.batch.trajectory import Trajectory, simulate
from vibrodrive.figures.style import save
from vibrodrive.model import config
from vibrodrive.model.parameters import bad
from vibrodrive.model.plan import Plan
from vibrodrive.model.results import Results
from vibrodrive.stability.structure import Orbit, orbit
from vibrodrive.store.draft import drafted
from vibrodrive.store.file import new_file
from vibrodrive.store.header import refuse_foreign
from vibrodrive.store.kind import special
from vibrodrive.store.layout import Origin, about
from vibrodrive.store.reader import load
from vibrodrive.store.writer import open_writer

Say = Callable[[str], None]
"""Called with a line that says what is going on."""


class Paper(NamedTuple):
    """What `run_paper` leaves behind: the files written, and the claims (see claim.Claim)."""

    files: list[Path]
    claims: list[Any]


def configurations() -> Path:
    """The directory of the configurations: beside the package in a checkout, inside it when installed."""
    here = Path(__file__).parents[1]
    for place in (here / "configs", here.parent / "configs"):
        if place.is_dir():
            return place
    raise FileNotFoundError(2, "no configurations beside the package: give their directory", str(here))


class Desk:
    """Configurations, and what was computed from them in this run: each thing once.

    Raises config.ConfigError for a configuration that is wrong, OSError where the system refuses.
    """

    def __init__(self, configs: Path, out: Path, say: Say, threads: int | None = None) -> None:
        self.configs = configs
        self.out = out
        self.say = say
        self.threads = threads
        self.files: list[Path] = []
        self._kept: dict[Any, Any] = {}

    def config(self, name: str) -> config.Config:
        return self._once(("config", name), lambda: config.read(self.configs / f"{name}.toml"))

    def results(self, name: str) -> Results:
        """The sweep of a configuration, computed into NAME.h5."""
        return self._once(("results", name), lambda: self._sweep(name))

    def motions(self, name: str) -> list[Trajectory]:
        """The trajectory of every point of a configuration; their switches go into NAME_switches.h5."""
        return self._once(("motions", name), lambda: self._follow(name))

    def undisturbed(self, name: str, **changes: Any) -> Orbit:
        """The orbit of a configuration with ε = 0 and certified switches, at its first point.

        Raises Unfit if it has no period.
        """
        plan = self.config(name).plan()
        exact = {"method": "certified", "eps": 0.0, "dtau": None, "periods": 256}
        motion = simulate(**(plan.arguments(0) | exact | changes))
        found = orbit(motion)
        if found is None:
            raise Unfit(f"the undisturbed motion at A = {motion.arguments['A']:g} has no period")
        return found

    def _once(self, key: Any, make: Callable[[], Any]) -> Any:
        if key not in self._kept:
            self._kept[key] = make()
        return self._kept[key]

    def _sweep(self, name: str) -> Results:
        wanted = self.config(name)
        path = self.out / f"{name}.h5"
        origin = Origin(wanted.text, wanted.overrides, wanted.title)
        writer = open_writer(path, wanted.plan(), origin, overwrite=True)
        try:
            for block in run_blocks(writer.plan, threads=self.threads):
                writer.write(block)
        finally:
            writer.close()
        self.files.append(path)
        return load(path)

    def _follow(self, name: str) -> list[Trajectory]:
        plan = self.config(name).plan()
        motions = [simulate(**arguments) for arguments in points(plan)]
        path = self.out / f"{name}_switches.h5"
        wanted = self.config(name)
        with new_file(path, seal=True) as file:
            file.attrs.update(about("switches", Origin(wanted.text, wanted.overrides, wanted.title)))
            for k, motion in enumerate(motions):
                group = file.create_group(f"motion_{k}")
                group.create_dataset("switches", data=motion.switches, fletcher32=True, chunks=True)
                group.create_dataset("section", data=motion.section, fletcher32=True, chunks=True)
                for key, value in motion.arguments.items():
                    group.attrs[key] = value
        self.files.append(path)
        return motions


class Unfit(ValueError):
    """A configuration was changed such that a claim cannot be tested on it."""


def points(plan: Plan) -> Iterator[dict[str, Any]]:
    """Arguments of `simulate` for every point of a plan."""
    return map(plan.arguments, range(plan.n_points))


def _prepare(folder: Path, configs: Path, figures: Sequence[str]) -> None:
    """Make the directory, and refuse what in it must not be replaced. Raises ValueError or OSError."""
    try:
        os.stat(folder)  # links in a circle have a name, and mkdir says no more than that it exists
    except FileNotFoundError:
        folder.mkdir(parents=True, exist_ok=True)
    if not os.access(folder, os.W_OK | os.X_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(folder))
    sources = sorted(configs.glob("*.toml"))
    names = {p.stem for p in sources}
    data = [folder / f"{name}{ending}" for name in names for ending in (".h5", "_switches.h5")]
    others = [folder / f"{name}{ending}" for name in figures for ending in (".png", ".pdf")]
    for path in [*data, *others, folder / "claims.json", folder / "claims.md"]:
        if not path.exists():
            continue
        what = special(path)
        if what is not None:
            raise ValueError(bad("output", str(path), f"a file, and this is {what}"))
        for config_file in sources:
            if config_file.exists() and path.samefile(config_file):
                raise ValueError(bad("output", str(path), f"another file than the configuration {config_file}"))
        if path in data:
            refuse_foreign(path)


def run_paper(
    out: str | Path,
    figures: Sequence[str] | None = None,
    progress: Say | None = None,
    configs: str | Path | None = None,
    threads: int | None = None,
) -> Paper:
    """Recompute the paper into a directory: NAME.png, NAME.pdf, NAME.h5, claims.json and claims.md.

    Parameters
    ----------
    out : path
        directory; made if it is not there. Files of an earlier run are replaced, if they are what they are called:
        a .h5 that is no result file, or a name that leads to a configuration, is refused.
    figures : sequence of str, optional
        names (see figures.FIGURES) of what is to be drawn; all unless told. Claims about other figures
        are left out.
    progress : callable, optional
        called with a line for each step.
    configs : path, optional
        directory of the configurations; those of this package unless told.
    threads : int, optional

    Raises
    ------
    ValueError
        for an unknown figure, a configuration that is wrong, or a file that must not be replaced.
    OSError
        if a file cannot be read or written.
    """
    # they all work at a Desk: imported where this module is complete
    from vibrodrive.paper import claims_grid, claims_physical, claims_undisturbed  # noqa: F401
    from vibrodrive.paper.claim import CLAIMS, claims_table, judge
    from vibrodrive.paper.figures import FIGURES

    names = list(FIGURES) if figures is None else list(figures)
    for name in names:
        if name not in FIGURES:
            raise ValueError(bad("figure", name, "one of " + ", ".join(FIGURES)))
    say = progress or (lambda line: None)
    folder = Path(out)
    source = Path(configs) if configs is not None else configurations()
    _prepare(folder, source, list(FIGURES))
    desk = Desk(source, folder, say, threads)
    for name in names:
        say(f"{name}: {FIGURES[name].title}")
        drawn = FIGURES[name].draw(desk)
        desk.files += [save(drawn, folder / f"{name}{ending}") for ending in (".png", ".pdf")]
    judged = []
    for claim in sorted((c for c in CLAIMS if c.figure in names), key=lambda c: list(FIGURES).index(c.figure)):
        say(f"claim {claim.id}")
        judged.append(judge(claim, desk))
    document = {"vibrodrive": __version__, "claims": [c.record() for c in judged]}
    listed = json.dumps(document, indent=1, ensure_ascii=False) + "\n"
    for name, text in {"claims.json": listed, "claims.md": claims_table(judged)}.items():
        with drafted(folder / name) as draft:
            draft.write_text(text)
        desk.files.append(folder / name)
    return Paper(desk.files, judged)
