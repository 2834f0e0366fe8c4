"""docs/model.md: its files and functions exist, and their docstrings name the same equations."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PAGE = ROOT / "docs" / "model.md"
TEXT = PAGE.read_text()

LINK = re.compile(r"\[`([\w.]+)`\]\(\.\./([\w/]+\.py)\)((?:[:,]\s`\w+`)*)")
"""Link to a file, with its name, its path and names of its functions: [`file.py`](../path/file.py): `one`,
`another`."""


def named(text: str) -> list[tuple[str, str]]:
    """Return (path, function) for every function that `text` names in a file."""
    return [(path, name) for _, path, names in LINK.findall(text) for name in re.findall(r"\w+", names)]


def definitions(path: str) -> dict[str, str]:
    """Return the functions, classes and constants of a file, with their docstrings."""
    found = {}
    for node in ast.parse((ROOT / path).read_text()).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            found[node.name] = ast.get_docstring(node) or ""
        elif isinstance(node, ast.Assign):
            found |= {target.id: "" for target in node.targets if isinstance(target, ast.Name)}
    return found


def equations(docstring: str) -> set[int]:
    """Return the numbers in "eq. (2)", "eqs. (3)-(5)", "eqs. (4), (5)"."""
    numbers: set[int] = set()
    for group in re.findall(r"\beqs?\.\s((?:\(\d+\)(?:-|,\s)?)+)", docstring):
        for first, last in re.findall(r"\((\d+)\)(?:-\((\d+)\))?", group):
            numbers |= set(range(int(first), int(last or first) + 1))
    return numbers


ROWS = [(int(number), named(row)) for number, row in re.findall(r"^\| \((\d+)\) \|(.*)$", TEXT, re.MULTILINE)]


def test_page_states_all_ten_equations_and_their_functions():
    tags = {int(n) for group in re.findall(r"\\tag\{([\d, ]+)\}", TEXT) for n in group.split(", ")}
    assert tags == set(range(1, 11))
    assert [number for number, _ in ROWS] == list(range(1, 11))
    assert all(places for _, places in ROWS)


@pytest.mark.parametrize(("path", "name"), sorted(set(named(TEXT))))
def test_named_functions_are_in_their_files(path, name):
    assert name in definitions(path)


@pytest.mark.parametrize(("number", "path", "name"), [(n, *place) for n, places in ROWS for place in places])
def test_function_names_its_equation(number, path, name):
    assert number in equations(definitions(path)[name])
