"""One run of the paper: its configurations and their results, each computed once."""

from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

from vibrodrive.batch.sweep import run_blocks
from vibrodrive.batch.trajectory import Trajectory, simulate
from vibrodrive.model import config
from vibrodrive.model.results import Results
from vibrodrive.stability.structure import ReferenceOrbit, reference_orbit
from vibrodrive.store.every_kind import load
from vibrodrive.store.file import new_file
from vibrodrive.store.layout import Origin, about
from vibrodrive.store.writer import open_writer
from vibrodrive.verdicts import NotApplicable

Say = Callable[[str], None]  # function that is called at each step with a line of text


class Session:
    """Configurations and their results, each computed once.

    Raises config.ConfigError for an invalid configuration, OSError if the system refuses to read or write a file.
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

    def points(self, name: str, least: int = 1) -> list[dict[str, Any]]:
        """Return the arguments of `simulate` for each point of a configuration.

        Raises NotApplicable if there are fewer than `least` points.
        """
        plan = self.config(name).plan()
        if plan.n_points < least:
            raise NotApplicable(f"{name} has fewer than {least} points")
        return [plan.arguments(at) for at in range(plan.n_points)]

    def results(self, name: str) -> Results:
        """Return the sweep of a configuration, computed into NAME.h5."""
        return self._once(("results", name), lambda: self._sweep(name))

    def motions(self, name: str) -> list[Trajectory]:
        """Return the trajectories of all points of a configuration; their switches are written to NAME_switches.h5."""
        return self._once(("motions", name), lambda: self._follow(name))

    def undisturbed(self, name: str, **changes: Any) -> ReferenceOrbit:
        """Return the orbit at the first point of a configuration, with ε = 0 and certified switches.

        `changes` are arguments of `simulate` that replace those of the configuration.
        Raises NotApplicable if the motion has no period.
        """
        plan = self.config(name).plan()
        exact = {"method": "certified", "eps": 0.0, "dtau": None, "tol": None, "periods": 256}
        motion = simulate(**(plan.arguments(0) | exact | changes))
        found = reference_orbit(motion)
        if found is None:
            raise NotApplicable(f"the undisturbed motion at A = {motion.arguments['A']:g} has no period")
        return found

    def _once(self, key: Any, make: Callable[[], Any]) -> Any:
        if key not in self._kept:
            self._kept[key] = make()
        return self._kept[key]

    def _sweep(self, name: str) -> Results:
        path = self.out / f"{name}.h5"
        with closing(
            open_writer(path, self.config(name).plan(), Origin.of(self.config(name)), overwrite=True)
        ) as writer:
            for block in run_blocks(writer.plan, threads=self.threads):
                writer.write(block)
        self.files.append(path)
        return load(path)

    def _follow(self, name: str) -> list[Trajectory]:
        motions = [simulate(**arguments) for arguments in self.points(name)]
        path = self.out / f"{name}_switches.h5"
        with new_file(path, seal=True) as file:
            file.attrs.update(about("switches", Origin.of(self.config(name))))
            for k, motion in enumerate(motions):
                group = file.create_group(f"motion_{k}")
                group.create_dataset("switches", data=motion.switches, fletcher32=True, chunks=True)
                group.create_dataset("section", data=motion.section, fletcher32=True, chunks=True)
                group.attrs.update(motion.arguments)
        self.files.append(path)
        return motions
