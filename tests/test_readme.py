"""What the README shows runs, what it names exists, and what it counts is what is there."""

from __future__ import annotations

import re
import shlex
import tomllib
from pathlib import Path

import numpy as np
import pytest
from packaging.requirements import Requirement

import vibrodrive as vd
from vibrodrive.cli import cli
from vibrodrive.jobs.sweep import Job, run
from vibrodrive.model import config, plan
from vibrodrive.model.size import block_bytes, file_bytes
from vibrodrive.store.layout import Origin

ROOT = Path(__file__).parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
README = PAGES[0].read_text()
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def blocks(language):
    """Fenced blocks of the README."""
    return re.findall(rf"^```{language}\n(.*?)^```", README, re.DOTALL | re.MULTILINE)


def commands():
    """Every command line of vibrodrive that can be typed as it stands."""
    shown = re.findall(r"`(?:vibrodrive) ([^`]+)`", README)
    shown += [line.split("bin/vibrodrive ")[1] for line in "".join(blocks("sh")).splitlines() if "bin/vibro" in line]
    return [part.strip().removeprefix("vibrodrive ") for line in shown for part in line.split("&&")]


def test_commands_parse_and_their_configurations_exist():
    assert len(commands()) > 10
    for line in commands():
        name, *arguments = shlex.split(line)
        assert name in cli.commands, line
        command = cli.commands[name]
        command.make_context(name, arguments)
        for argument in arguments:
            if argument.startswith(("configs/", "docs/")):
                assert (ROOT / argument).exists(), line


def test_every_command_is_in_the_table():
    assert {re.match(r"\w+", line)[0] for line in commands()} >= set(cli.commands)


def test_options_named_in_the_text_exist():
    known = {name for c in cli.commands.values() for p in c.params for name in p.opts} | {"--help"}
    assert set(re.findall(r"`[a-z ]*(--[a-z-]+)", README)) <= known


def test_the_configuration_shown_is_one():
    (text,) = blocks("toml")
    shown = config.parse(text).plan()
    assert (shown.shape, shown.settings.periods) == ((1000, 2), 500)
    named = re.search(r"any of ([\w, ]+)\n", text)[1].split(", ")
    assert set(named) == set(plan.COLUMNS)


@pytest.mark.jit
def test_the_python_shown_runs_and_gives_what_it_says(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    physical, taste, files, cluster = blocks("python")
    names = {}
    for source in (physical, taste):
        exec(source, names)
    assert pytest.approx(3.06, abs=0.005) == names["scene"].A
    assert pytest.approx(0.099, abs=0.0005) == names["scene"].B
    assert names["scene"].length(6.5) == pytest.approx(1.7e-3, abs=5e-5)
    assert names["motion"].section.shape == (250, 2)
    assert names["r"].section.shape == (1000, 2, 500, 2)
    assert names["k"].k2 == pytest.approx(1.76e-4, abs=5e-7)
    assert pytest.approx(2.60408063765613, abs=1e-13) == vd.bifurcations((2.5, 3.1), max_period=2)[1].A
    compile(cluster, "README", "exec")
    wanted = config.read(ROOT / "configs/fig07.toml", ["A.num=26", "transient=1", "periods=2"])
    run(Job(wanted.plan(), Origin(wanted.text, wanted.overrides), Path("fig07.h5")), Silent())
    exec(files, names)


class Silent:
    def update(self, line):
        pass

    say = compiling = update

    def clear(self):
        pass


def test_pictures_and_pages_exist_and_are_small():
    for page in PAGES:
        for target in re.findall(r"\]\(([^)#:]+)\)", page.read_text()):
            path = page.parent / target
            assert path.exists(), f"{page.name}: {target}"
            if path.suffix == ".png":
                assert path.stat().st_size < 300_000, target


def test_every_dependency_has_its_reason():
    table = README.split("## What it depends on")[1].split("\n## ")[0]
    rows = [line.split("|")[1].strip() for line in table.splitlines() if line.startswith("| ")][1:]
    named = {"": set()}
    for row in rows:
        extra, packages = re.match(r"(?:\*(\w+):\* )?(.*)", row).groups()
        named.setdefault(extra or "", set()).update(packages.split(", "))
    needed = {"": PROJECT["dependencies"], **PROJECT["optional-dependencies"]}
    assert named == {extra: {Requirement(d).name for d in wanted} for extra, wanted in needed.items()}


def test_the_arithmetic_of_a_billion_points():
    big = plan.make_plan({"A": np.linspace(1, 3, 10**5), "B": np.linspace(0, 1, 10**4), "periods": 250})
    assert big.n_points == 10**9
    assert file_bytes(big) == pytest.approx(4.1e12, rel=0.02)
    assert "4.1 TB" in README
    assert "16·250 + 49 = 4049 bytes" in README
    assert block_bytes(big) >= 1000 * 4049


def test_the_citation_is_of_this_version():
    text = (ROOT / "CITATION.cff").read_text()
    assert f"\nversion: {vd.__version__}\n" in text
    assert "An Example for the Orbital Stability of Permanently Disturbed Non-smooth Motions" in text
