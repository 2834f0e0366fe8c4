"""The notebook examples/session.ipynb: every cell runs in a new kernel, without a warning and with the right output."""

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
NOTEBOOK = ROOT / "examples" / "session.ipynb"
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


@pytest.mark.jit
def test_cells_show_figures_and_tables_and_a_stopped_sweep_resumes(tmp_path):
    environment = os.environ | {"PYTHONPATH": str(ROOT), "PYTHONWARNINGS": "default", "IPYTHONDIR": str(tmp_path)}
    environment.pop("MPLBACKEND", None)  # otherwise cells would show no figures
    command = [sys.executable, "-c", RUN, str(NOTEBOOK), str(tmp_path / "ran.ipynb")]
    done = subprocess.run(command, env=environment, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    every = json.loads((tmp_path / "ran.ipynb").read_text())["cells"]
    ran = {"".join(cell["source"]): cell["outputs"] for cell in every if cell["cell_type"] == "code"}

    def outputs(source):
        (found,) = (there for text, there in ran.items() if source in text)
        return found

    def shown(source, kind="text/html"):
        return "".join(outputs(source)[-1]["data"][kind])

    assert [output for there in ran.values() for output in there if output.get("name") == "stderr"] == []
    for source in ("r.plot()", "motion.plot()", "diagram.plot(", "plt.subplots"):
        pixels = matplotlib.image.imread(io.BytesIO(base64.b64decode(shown(source, "image/png"))))
        assert pixels.shape[1] > 500
        assert 0.01 < (pixels[..., :3].min(axis=-1) < 0.5).mean() < 0.6, "the figure must not be empty or black"
    assert any("stopped\n" in output.get("text", []) for output in outputs("press_stop"))
    (share,) = re.findall(
        r"<td>([0-9.]+) % computed</td>", "".join(ran['vd.load("diagram.h5")'][-1]["data"]["text/html"])
    )
    assert 0 < float(share) < 100
    assert "<td>computed</td>" in shown("diagram = vd.sweep")
    assert outputs("one = r.select")[0]["text"][0].startswith("OK ")
    assert "<td>251 × 2 points</td>" in shown("r = vd.sweep")
    assert "IMPACT" in shown("to_dataframe")
    assert "xarray" in shown("to_xarray")
    assert shown("many = vd.sweep", "text/plain").count("[") == 3, "two coexisting solutions must give two points"


def test_stored_notebook_has_no_output_and_uses_public_names_only():
    kept = json.loads(NOTEBOOK.read_text())["cells"]
    sources = ["".join(cell["source"]) for cell in kept if cell["cell_type"] == "code"]
    assert not any(cell.get("outputs") for cell in kept)
    assert not any("vibrodrive." in source or "._" in source for source in sources)
