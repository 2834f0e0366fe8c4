"""The session in a notebook: every cell runs in a kernel of its own, without a warning, and shows what it should."""

from __future__ import annotations

import base64
import io
import json
import os
import subprocess
import sys
from pathlib import Path

import matplotlib.image
import pytest

ROOT = Path(__file__).parent.parent.parent
NOTEBOOK = ROOT / "docs" / "session.ipynb"
RUN = """
import sys, nbformat
from nbclient import NotebookClient
notebook = nbformat.read(sys.argv[1], as_version=4)
NotebookClient(notebook, timeout=300, kernel_name="python3").execute()
nbformat.write(notebook, sys.argv[2])
"""

pytest.importorskip("nbclient")
pytest.importorskip("ipykernel")


@pytest.fixture(scope="module")
def cells(tmp_path_factory):
    """The code cells as they are after they ran, in order."""
    folder = tmp_path_factory.mktemp("notebook")
    environment = os.environ | {"PYTHONPATH": str(ROOT), "PYTHONWARNINGS": "default", "IPYTHONDIR": str(folder)}
    command = [sys.executable, "-c", RUN, str(NOTEBOOK), str(folder / "ran.ipynb")]
    done = subprocess.run(command, env=environment, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found = json.loads((folder / "ran.ipynb").read_text())["cells"]
    return [cell for cell in found if cell["cell_type"] == "code"]


def shown(cells, source):
    """What the one cell whose source has this text in it puts out, by MIME type."""
    (cell,) = (cell for cell in cells if source in "".join(cell["source"]))
    return cell["outputs"][-1]["data"]


@pytest.mark.jit
def test_no_cell_warns_or_prints_what_was_not_asked_for(cells):
    told = [output for cell in cells for output in cell["outputs"] if output.get("name") == "stderr"]
    assert told == []


@pytest.mark.jit
@pytest.mark.parametrize("source", ["r.plot()", "motion.plot()", "vd.plot.bifurcation(up"])
def test_figures_are_shown(cells, source):
    png = base64.b64decode(shown(cells, source)["image/png"])
    pixels = matplotlib.image.imread(io.BytesIO(png))
    assert pixels.shape[1] > 1000
    assert 0.01 < (pixels[..., :3].min(axis=-1) < 0.5).mean() < 0.6, "neither empty nor a black block"


@pytest.mark.jit
def test_results_and_tables_are_shown(cells):
    assert "<td>251 × 2 points</td>" in "".join(shown(cells, "r = vd.sweep")["text/html"])
    assert "IMPACT" in "".join(shown(cells, "to_dataframe")["text/html"])
    assert "xarray" in "".join(shown(cells, "to_xarray")["text/html"])
    solutions = "".join(shown(cells, "many = vd.sweep")["text/plain"])
    assert solutions.count("[") == 3, "two solutions coexist: two points of one section"


def test_what_is_kept_has_no_output_and_nothing_that_is_not_public():
    kept = json.loads(NOTEBOOK.read_text())["cells"]
    sources = ["".join(cell["source"]) for cell in kept if cell["cell_type"] == "code"]
    assert not any(cell.get("outputs") for cell in kept)
    assert not any("vibrodrive." in source or "._" in source for source in sources)
