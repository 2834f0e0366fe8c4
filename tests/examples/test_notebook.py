"""The notebook docs/session.ipynb: every cell runs in a new kernel without a warning and has the expected output."""

import base64
import io
import json
import os
import re
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

pytestmark = [
    pytest.mark.skipif(sys.platform == "win32", reason="a cell sends its own process a signal"),
    pytest.mark.slow("10 s together: a notebook is run in a kernel of its own; its calls are tested elsewhere"),
]

pytest.importorskip("nbclient")
pytest.importorskip("ipykernel")


@pytest.fixture(scope="module")
def cells(tmp_path_factory):
    """Return the code cells after their run, in order."""
    folder = tmp_path_factory.mktemp("notebook")
    environment = os.environ | {"PYTHONPATH": str(ROOT), "PYTHONWARNINGS": "default", "IPYTHONDIR": str(folder)}
    environment.pop("MPLBACKEND", None)  # otherwise cells would show no figures
    command = [sys.executable, "-c", RUN, str(NOTEBOOK), str(folder / "ran.ipynb")]
    done = subprocess.run(command, env=environment, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found = json.loads((folder / "ran.ipynb").read_text())["cells"]
    return [cell for cell in found if cell["cell_type"] == "code"]


def shown(cells, source):
    """Return the output, by MIME type, of the one cell whose source contains this text."""
    (cell,) = (cell for cell in cells if source in "".join(cell["source"]))
    return cell["outputs"][-1]["data"]


@pytest.mark.jit
def test_cells_print_nothing_to_stderr(cells):
    told = [output for cell in cells for output in cell["outputs"] if output.get("name") == "stderr"]
    assert told == []


@pytest.mark.jit
@pytest.mark.parametrize("source", ["r.plot()", "motion.plot()", "diagram.plot(", "plt.subplots"])
def test_figures_are_shown(cells, source):
    png = base64.b64decode(shown(cells, source)["image/png"])
    pixels = matplotlib.image.imread(io.BytesIO(png))
    assert pixels.shape[1] > 500
    assert 0.01 < (pixels[..., :3].min(axis=-1) < 0.5).mean() < 0.6, "the figure must not be empty or black"


@pytest.mark.jit
def test_stopped_sweep_resumes(cells):
    (stopped,) = (cell for cell in cells if "press_stop" in "".join(cell["source"]))
    assert any("stopped\n" in output.get("text", []) for output in stopped["outputs"])
    (loaded,) = (cell for cell in cells if "".join(cell["source"]) == 'vd.load("diagram.h5")')
    table = "".join(loaded["outputs"][-1]["data"]["text/html"])
    (share,) = re.findall(r"<td>([0-9.]+) % computed</td>", table)
    assert 0 < float(share) < 100
    assert "<td>computed</td>" in "".join(shown(cells, "diagram = vd.sweep")["text/html"])


@pytest.mark.jit
def test_results_and_tables_are_shown(cells):
    (one,) = (cell for cell in cells if "one = r.select" in "".join(cell["source"]))
    assert one["outputs"][0]["text"][0].startswith("OK ")
    assert "<td>251 × 2 points</td>" in "".join(shown(cells, "r = vd.sweep")["text/html"])
    assert "IMPACT" in "".join(shown(cells, "to_dataframe")["text/html"])
    assert "xarray" in "".join(shown(cells, "to_xarray")["text/html"])
    solutions = "".join(shown(cells, "many = vd.sweep")["text/plain"])
    assert solutions.count("[") == 3, "two coexisting solutions must give two points of one section"


def test_stored_notebook_has_no_output_and_uses_public_names_only():
    kept = json.loads(NOTEBOOK.read_text())["cells"]
    sources = ["".join(cell["source"]) for cell in kept if cell["cell_type"] == "code"]
    assert not any(cell.get("outputs") for cell in kept)
    assert not any("vibrodrive." in source or "._" in source for source in sources)
