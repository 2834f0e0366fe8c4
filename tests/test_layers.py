"""Who may import whom: the contracts of pyproject.toml hold, and a breach is noticed."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("importlinter")

ROOT = Path(__file__).parent.parent


def lint(folder):
    """Exit code and report of the linter on the package in a folder."""
    code = "from importlinter.cli import lint_imports_command as lint; lint(['--no-cache'])"
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(folder)},
        capture_output=True,
        text=True,
    )
    return done.returncode, done.stdout + done.stderr


@pytest.fixture
def copy(tmp_path):
    """The package and its contracts, where they may be spoilt."""
    shutil.copytree(ROOT / "vibrodrive", tmp_path / "vibrodrive", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    return tmp_path


def test_the_contracts_hold():
    code, report = lint(ROOT)
    assert code == 0, report
    assert "0 broken" in report


@pytest.mark.parametrize(
    ("module", "line", "complaint"),
    [
        ("kernels/engine", "import h5py", "engine -> h5py"),
        ("kernels/motion", "from vibrodrive.store import writer", "motion -> vibrodrive.store.writer"),
        ("kernels/motion", "from vibrodrive.kernels import engine", "motion -> vibrodrive.kernels.engine"),
        ("store/layout", "from vibrodrive.jobs import sweep", "layout -> vibrodrive.jobs.sweep"),
        ("periodic/search", "from vibrodrive.stability import structure", "search -> vibrodrive.stability.structure"),
        ("kernels/novelty", "", "novelty"),
        ("novelty", "", "novelty"),
    ],
)
def test_a_breach_is_noticed(copy, module, line, complaint):
    with open(copy / "vibrodrive" / f"{module}.py", "a") as source:
        source.write(f"\n{line}\n")
    code, report = lint(copy)
    assert code == 1
    assert complaint in report
