"""The linter reports imports that the contracts of pyproject.toml forbid. No import is circular."""

import ast
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("importlinter")

ROOT = Path(__file__).parent.parent


BREACHES = [
    ("kernels/engine", "import h5py", "engine -> h5py"),
    ("kernels/motion", "from vibrodrive.store import writer", "motion -> vibrodrive.store.writer"),
    ("kernels/motion", "from vibrodrive.kernels import engine", "motion -> vibrodrive.kernels.engine"),
    ("store/layout", "from vibrodrive.jobs import sweep", "layout -> vibrodrive.jobs.sweep"),
    ("periodic/search", "from vibrodrive.stability import structure", "search -> vibrodrive.stability.structure"),
    ("stability/limit", "import numba", "vibrodrive.stability.limit -> numba"),
    ("kernels/novelty", "", "vibrodrive.kernels.novelty"),
    ("novelty", "", "vibrodrive.novelty"),
    ("explorer/work", "from vibrodrive.kernels import engine", "explorer.work -> vibrodrive.kernels.engine"),
]
"""(module, line added to the module, complaint of the linter). `.ci/run` checks the package without these lines."""


def test_breaches_of_the_contracts_are_detected(tmp_path):
    shutil.copytree(ROOT / "vibrodrive", tmp_path / "vibrodrive", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    for module, line, _ in BREACHES:
        with open(tmp_path / "vibrodrive" / f"{module}.py", "a") as source:
            source.write(f"\n{line}\n")
    code = "from importlinter.cli import lint_imports_command as lint; lint(['--no-cache'])"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, env=os.environ | {"PYTHONPATH": "."}, capture_output=True, text=True
    )
    assert done.returncode == 1
    assert [complaint for *_, complaint in BREACHES if complaint not in done.stdout] == []


def test_files_named_in_the_check_of_all_exist():
    named = re.findall(r"tests/[\w/]+(?:\.py)?", (ROOT / ".ci" / "run").read_text())
    assert [name for name in named if not (ROOT / name).exists()] == []
    assert len(named) > 10


def test_no_import_is_circular():
    """The contracts ignore imports within functions and imports for types only; this test includes them."""
    files = {".".join(p.relative_to(ROOT).with_suffix("").parts): p for p in (ROOT / "vibrodrive").rglob("*.py")}
    paths = {name.removesuffix(".__init__"): path for name, path in files.items()}
    imported: dict[str, set[str]] = {}
    for name, path in paths.items():
        nodes = [node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.ImportFrom)]
        named = [(n.module, f"{n.module}.{a.name}") for n in nodes for a in n.names]
        imported[name] = {inner if inner in paths else outer for outer, inner in named} & paths.keys()

    def reached(start: str) -> set[str]:
        seen: set[str] = set()
        todo = [start]
        while todo:
            new = imported[todo.pop()] - seen
            seen |= new
            todo += new
        return seen

    below = {name: reached(name) for name in paths}
    circles = {name: {other for other in below[name] if name in below[other]} for name in paths}
    assert {name: circle for name, circle in circles.items() if circle} == {}
