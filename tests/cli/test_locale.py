"""The commands read and write the same files in locales without UTF-8, and print the characters that these contain."""

import json
import os
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest

import vibrodrive as vd
from tests.support.process import ROOT
from vibrodrive.model.packaged import configurations

pytestmark = pytest.mark.jit

TITLE = "Rütteln bei ε = 2e-4"
CONFIG = f'title = "{TITLE}"  # ξ′\n[sweep]\nA = [3.0, 3.04]\n[run]\ntransient = 10\nperiods = 5\n'


@pytest.fixture(params=["ascii", "iso8859-1"])
def run(request, tmp_path, monkeypatch):
    """Return a function that starts a command in an empty folder with a locale, and the encoding of this locale."""
    monkeypatch.chdir(tmp_path)
    locale = {"PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0", "LC_ALL": "C"}
    if request.param != "ascii":
        locale |= {"LOCPATH": str(tmp_path), "LC_ALL": "en_US.ISO-8859-1"}
        try:
            subprocess.run(["localedef", "-i", "en_US", "-f", "ISO-8859-1", "./en_US.ISO-8859-1"], check=True)
        except (OSError, subprocess.CalledProcessError):
            pytest.skip("there are no sources of locales here (Debian: locales)")

    environment = os.environ | locale | {"PYTHONPATH": str(ROOT)}

    def start(*arguments):
        return subprocess.Popen([sys.executable, *arguments], env=environment, stdout=subprocess.PIPE)

    with start("-c", "import sys; print(sys.stdout.encoding)") as process:
        assert process.stdout.read().decode().strip() == request.param
    return start, request.param


@pytest.mark.slow("6 s each: nine processes")
def test_commands_read_and_write_the_same_files_in_any_locale(run):
    start, encoding = run

    def output(*arguments):
        with start("-m", "vibrodrive", *arguments) as process:
            out = process.stdout.read()
        assert process.returncode == 0, arguments
        return out

    Path("ü.toml").write_text(CONFIG, encoding="utf-8")
    title = "η".encode() if encoding == "ascii" else "ü".encode("latin-1")  # as a terminal sends it
    output("sweep", "ü.toml", "-o", "t.h5", "--set", b"title=" + title)
    assert vd.load("t.h5").title == title.decode("utf-8" if encoding == "ascii" else "latin-1")
    output("init", "quickstart")
    supplied = (configurations() / "quickstart.toml").read_text(encoding="utf-8")
    assert Path("quickstart.toml").read_text(encoding="utf-8") == supplied.replace("configs/", "")
    output("sweep", "ü.toml", "--plot")
    here = vd.sweep(A=[3.0, 3.04], transient=10, periods=5)
    assert (vd.load("ü.h5").section == here.section).all()
    assert Path("ü.png").exists()
    assert json.loads(output("info", "ü.h5", "--json"))["title"] == TITLE
    shown = output("info", "ü.h5", "--check")
    assert ("R" if encoding == "ascii" else "R\xfctteln bei ? =").encode("latin-1") in shown
    output("trajectory", "ü.toml", "--set", "A=3.04", "-o", "ü.csv", "-o", "ü.svg")
    assert Path("ü.csv").read_bytes().count(b"\n") > 10
    assert Path("ü.svg").exists()
    output("orbits", "ü.toml", "-o", "o.csv")


def test_page_is_the_same_in_any_locale(run):
    pytest.importorskip("tornado")
    from vibrodrive.explorer.server import build
    from vibrodrive.explorer.view import View

    with run[0]("-m", "vibrodrive", "explore", "--no-browser", "--port", "0") as process:
        try:
            with urllib.request.urlopen(process.stdout.readline().decode().strip(), timeout=600) as page:
                assert page.read().decode() == build(View())
        finally:
            process.kill()
