"""README and pages: links exist, commands are valid, examples run, and counts are right.

Cells (`{code-cell}`) run when the site is built (.ci/run); all other examples are checked here.
"""

import ast
import json
import re
import shlex
import tomllib
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from packaging.requirements import Requirement

import vibrodrive as vd
from benchmarks import draw
from vibrodrive.cli import cli
from vibrodrive.model import config
from vibrodrive.model.names import AXES

ROOT = Path(__file__).parent.parent
DOCS = ROOT / "docs"
TOP = [ROOT / name for name in ("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "RELEASING.md")]
PAGES = [*TOP, *sorted(DOCS.rglob("*.md"))]
BESIDE = [*sorted((ROOT / "benchmarks").rglob("*.md")), ROOT / "examples" / "session.ipynb"]  # not pages of the site
README = TOP[0].read_text()
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]

each_page = pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))


def blocks(text, language):
    """Return the fenced blocks of a page in this language. The language "{code-cell}" means cells of the site."""
    found = re.findall(r"^```(\S+)\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    return [content for name, content in found if name == language]


def typed(text):
    """Return the command lines of a page: in blocks of sh, in cells of %%sh, and in the text."""
    shell = blocks(text, "sh") + [cell for cell in blocks(text, "{code-cell}") if "%%sh" in cell]
    lines = [
        re.sub(r"\s(#|\d?>).*", "", line)
        for line in "\n".join(shell).splitlines()
        if not line.startswith((":tags", "%%"))
    ]
    words = re.findall(r"`((?:vibrodrive|python -m) [^`=]+)`", re.sub(r"^```.*?^```", "", text, flags=re.S | re.M))
    parts = [part.strip() for line in lines + words for part in line.split("&&")]
    return [re.sub(r"^\S*bin/", "", part) for part in parts if part and "…" not in part]


def anchors(path):
    """Return the anchors of the headings of a page, as GitHub forms them."""
    text = re.sub(r"^```.*?^```", "", path.read_text(), flags=re.DOTALL | re.MULTILINE)
    titles = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


def links(path):
    """Return the targets of the links and pictures of a page or notebook."""
    text = path.read_text()
    if path.suffix == ".ipynb":
        text = "\n".join(
            "".join(cell["source"]) for cell in json.loads(text)["cells"] if cell["cell_type"] == "markdown"
        )
    return re.findall(r"\]\(([^)\s]+)\)", re.sub(r"^```.*?^```|`[^`\n]+`", "", text, flags=re.DOTALL | re.MULTILINE))


@pytest.mark.parametrize("page", [*PAGES, *BESIDE], ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_to_files_and_headings(page):
    for target in links(page):
        if target.startswith(("https://", "http://")):
            continue
        name, _, anchor = target.partition("#")
        path = page.parent / name if name else page
        assert path.exists(), target
        assert not anchor or anchor in anchors(path), target
        if path.suffix == ".png" and path.parent == DOCS:
            assert path.stat().st_size < 300_000, target


@pytest.mark.parametrize("page", [p for p in PAGES if p.name != "CHANGELOG.md"], ids=lambda p: str(p.relative_to(ROOT)))
def test_commands_are_valid(page):
    for line in typed(page.read_text()):
        program, *arguments = shlex.split(line)
        if program == "vibrodrive":
            _parse(line, *arguments)
        elif program.startswith("python") and "-m" in arguments:
            module = arguments[arguments.index("-m") + 1]
            assert module in ("venv", "build", "twine", "pip") or find_spec(module), line
        elif program == "python":  # tests/benchmarks/test_switches.py runs both programs
            assert arguments[0] in {"solver.py", "score.py"}, line
        else:
            assert program in {".ci/run", "pip", "pytest", "sphinx-build", "NUMBA_DISABLE_JIT=1"}, line


def _parse(line, name, *arguments):
    """Assert that the command accepts these arguments. Without arguments, or with options only, the command is
    incomplete."""
    if name.startswith("--"):
        return
    assert name in cli.commands, line
    command = cli.commands[name]
    known = {option for parameter in command.params for option in parameter.opts} | {"--help"}
    assert {word for word in arguments if word.startswith("--")} <= known, line
    whole = any(not word.startswith("-") for word in arguments)
    command.make_context(name, list(arguments), resilient_parsing=not whole)
    for word in arguments:
        if word.startswith(("configs/", "docs/")):
            assert (ROOT / word).exists(), line


def test_pages_write_different_files():
    """All pages can then run one after another in one folder."""
    written = {}
    for page in PAGES:
        for cell in blocks(page.read_text(), "{code-cell}"):
            for name in re.findall(r"(?:-o |path=\"|%%writefile |vibrodrive init )([\w.]+)", cell):
                assert written.setdefault(name.removesuffix(".toml"), page) == page, name


def test_every_command_is_in_the_table():
    shown = {re.match(r"vibrodrive (\w+)", line)[1] for line in typed((DOCS / "commands.md").read_text())}
    assert shown >= {name for name, command in cli.commands.items() if not command.hidden}


@each_page
def test_options_named_in_the_text_exist(page):
    known = {name for c in cli.commands.values() for p in c.params for name in p.opts} | {"--help", "--version"}
    said = re.findall(r"`(?:vibrodrive )?(?:\w+ )?(--[a-z-]+)[^`]*`", page.read_text())
    assert set(said) <= known


@each_page
def test_configurations_shown_are_accepted(page):
    text = page.read_text()
    cells = [cell.partition("\n")[2] for cell in blocks(text, "{code-cell}") if cell.startswith("%%writefile")]
    for shown in blocks(text, "toml") + cells:
        assert config.parse(shown).plan().n_points > 0


def test_table_of_keys_names_every_key():
    table, named = "", {}
    for row in (DOCS / "commands.md").read_text().split("## Every key")[1].split("\n## ")[0].splitlines():
        if row.startswith("| table"):
            table = ""
        elif row.startswith("| "):
            cells = row.split("|")
            table = cells[1].strip(" `[]") or table
            named.setdefault(table, set()).update(re.findall(r"`(\w+)`", cells[2]))
    assert named.pop("") == {"title"}
    assert named == {name: {*keys} - ({*AXES} if name == "sweep" else set()) for name, keys in config.TABLES.items()}


@pytest.mark.jit
def test_python_of_the_readme_gives_the_shown_values():
    (source,) = blocks(README, "python")
    names, values = {}, []
    for line in ast.parse(source).body:
        if isinstance(line, ast.Expr):
            values.append(eval(ast.unparse(line), names))
        else:
            exec(ast.unparse(line), names)
    assert names["r"].section.shape == (1000, 2, 500, 2)
    motion, k2, doubling, (A, B), machine, velocity, every = values
    assert "period 2; impacts per excitation period: 0.5" in str(motion)
    assert "mean impact speed 2.12872" in str(motion)
    assert k2 == pytest.approx(1.76e-4, abs=5e-7)
    assert doubling == pytest.approx(2.60408063765613, abs=1e-13)
    assert (round(A, 2), round(B, 3)) == (3.10, 0.099)
    shown = machine.rows["machine"]
    assert (round(shown["impacts"], 9), round(shown["impact_power"], 1)) == (12, 10.7)
    assert velocity == pytest.approx(5.8e-4, abs=5e-6)
    assert every == pytest.approx(2.1e-4, abs=5e-6)


@pytest.mark.jit
def test_python_of_the_page_of_orbits_runs(tmp_path, monkeypatch):
    """The example runs with fewer values than the page names."""
    monkeypatch.chdir(tmp_path)
    few = {"A": np.linspace(2.8, 3.25, 3), "transient": 20, "periods": 20}
    vd.sweep(**few, record="limit", path="limits.h5")
    shorter = {"4001": "41", "(1, 4), B=np.linspace(0.0, 0.5, 101)": "(2.5, 2.6), B=[0.1]", "400)": "4)", "300)": "3)"}
    for source in blocks((DOCS / "orbits.md").read_text(), "python"):
        for long, short in shorter.items():
            source = source.replace(long, short)
        exec(source, {})


def test_no_other_page_shows_untested_python():
    showing = {page.name for page in PAGES if blocks(page.read_text(), "python")}
    assert showing <= {"README.md", "orbits.md", "cluster.md", "where_methods_fail.md"}
    (source,) = blocks((DOCS / "cluster.md").read_text(), "python")
    compile(source, "cluster.md", "exec")  # it needs a cluster


def test_every_configuration_has_a_page_or_is_one_of_the_paper():
    said = "".join(page.read_text() for page in [*PAGES, *BESIDE])
    paper = "".join(path.read_text() for path in (ROOT / "benchmarks" / "paper").glob("*.py"))
    names = [path.stem for path in (ROOT / "configs").glob("*.toml")]
    assert [name for name in names if f"{name}.toml" not in said and f'"{name}"' not in paper] == []


def test_every_page_is_in_the_menu():
    listed = set(
        re.findall(r"^([\w/]+)$", "\n".join(blocks((DOCS / "index.md").read_text(), "{toctree}")), re.MULTILINE)
    )
    assert listed == {page.stem for page in DOCS.glob("*.md")} - {"index"}


def test_every_dependency_has_its_reason():
    table = (ROOT / "CONTRIBUTING.md").read_text().split("## Dependencies")[1].split("\n## ")[0]
    rows = [line.split("|")[1].strip() for line in table.splitlines() if line.startswith("| ")][1:]
    named = {"": set()}
    for row in rows:
        extra, packages = re.match(r"(?:\*(\w+):\* )?(.*)", row).groups()
        named.setdefault(extra or "", set()).update(packages.split(", "))
    needed = {"": PROJECT["dependencies"], **PROJECT["optional-dependencies"]}
    assert named == {extra: {Requirement(d).name for d in wanted} for extra, wanted in needed.items()}


def test_citation_names_this_version_and_gives_an_author_and_a_year_in_bibtex():
    """BibTeX takes the words of a name that has no braces, as of cffconvert, for a first and a last name."""
    text = (ROOT / "CITATION.cff").read_text()
    assert f"\nversion: {vd.__version__}\n" in text
    assert "An Example for the Orbital Stability of Permanently Disturbed Non-smooth Motions" in text
    about = text.partition("\nreferences:")[0]
    (author,) = re.findall(r'^  - name: "(.*)"', about, re.MULTILINE)
    assert re.search(r"^date-released: 20\d\d-\d\d-\d\d\b", about, re.MULTILINE)
    assert author.replace(r"\_", "\N{NO-BREAK SPACE}").lower().split(" ") == ["the\xa0vibrodrive\xa0authors"]


@pytest.mark.parametrize("chart", draw.charts(), ids=lambda chart: chart.picture.stem)
def test_chart_shows_the_stored_data_and_is_not_redrawn(chart, capsys):
    before = chart.picture.read_bytes()
    draw.draw(chart)
    assert chart.picture.read_bytes() == before
    assert "shows these data already" in (said := capsys.readouterr().err)
    assert f"`python -m {chart.command}` measures again" in said


def test_chart_of_other_data_is_redrawn(tmp_path):
    chart = draw.charts()[0]
    draw.draw(chart, tmp_path)
    first = (tmp_path / chart.picture.name).read_bytes()
    data = chart.load()
    data["points"].pop()
    draw.draw(chart._replace(load=lambda: data), tmp_path)
    assert (tmp_path / chart.picture.name).read_bytes() != first
