"""The server accepts only requests of this machine, with the token, and from its own pages. No test needs a browser."""

import asyncio
import gc
import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from contextlib import closing
from http.client import HTTPConnection
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("tornado")

from tornado.websocket import WebSocketClosedError, websocket_connect

import vibrodrive as vd
from tests.support.messages import messages
from tests.support.process import python
from vibrodrive.cli.explore import explore
from vibrodrive.explorer.session import Session

pytestmark = pytest.mark.jit

LIMIT = 1200.0
"""Seconds after which a test stops waiting for a process or an answer."""


@pytest.fixture(scope="module")
def explorer():
    found = vd.explore(threads=1)
    yield found
    found.close()


def port_of(explorer):
    return int(explorer.address.split(":")[2].split("/")[0])


def answer(address, **headers):
    """Return status and text of a GET request."""
    request = urllib.request.Request(address, headers={k.replace("_", "-"): v for k, v in headers.items()})
    try:
        with urllib.request.urlopen(request, timeout=LIMIT) as response:
            return response.status, response.read().decode()
    except urllib.error.HTTPError as error:
        with error:
            return error.code, error.read().decode()


UPGRADE = {
    "Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA==",
    "Sec-WebSocket-Version": "13",
}  # fmt: skip


def test_page_loads_nothing_else_and_is_framed_by_this_machine_only(explorer):
    with urllib.request.urlopen(explorer.address, timeout=LIMIT) as response:
        text, headers = response.read().decode(), response.headers
    assert "<title>vibrodrive explore</title>" in text
    assert re.findall(r"(?:src|href)=.?https?:", text) == []  # nothing comes from another server
    assert explorer.address.partition("token=")[2] not in text
    assert (headers["Cache-Control"], headers["Referrer-Policy"]) == ("no-store", "no-referrer")
    assert headers["Content-Security-Policy"].startswith("frame-ancestors http://localhost:* http://127.0.0.1:*")


def test_page_is_built_without_numba_and_matplotlib():
    script = "import sys; from vibrodrive.explorer import server; server.build(server.View(), ''); print(*sys.modules)"
    assert not {"numba", "matplotlib", "h5py"} & {*python(script).split()}


@pytest.mark.parametrize(
    "path", ["/", "/?token=", "/?token=x&token={token}", "/metadata", "/?low=3", "/nowhere", "/ws", "/ws?token=x",
             "/?token={token}x", "/?token=x{token}", "/?token={token:.20}", "/?Token={token}"],
)  # fmt: skip
def test_no_path_is_served_without_the_token(explorer, path):
    base, _, token = explorer.address.partition("/?token=")
    status, text = answer(base + path.format(token=token))
    assert (status, text.count("\n")) == (403, 1)
    assert "token" in text


NEAR = ["127.0.0.1", "127.0.0.1:{port}0", "0127.0.0.1:{port}", "127.0.0.1:{port}.evil.example", "localhost.evil:{port}"]
FOREIGN = {"Host": ["evil.example", "evil.example:80", *NEAR]}
FOREIGN["Origin"] = ["http://evil.example", "null", "https://127.0.0.1:{port}", *(f"http://{host}" for host in NEAR)]
FOREIGN["Sec-WebSocket-Origin"] = ["http://127.0.0.1:{port}0"]


@pytest.mark.parametrize(("header", "value"), [(header, value) for header in FOREIGN for value in FOREIGN[header]])
def test_foreign_hosts_and_origins_are_refused_even_with_the_token(explorer, header, value):
    sent = {header: value.format(port=port_of(explorer))}
    assert answer(explorer.address, **sent)[0] == 403
    assert answer(explorer.address.replace("/?", "/ws?"), **UPGRADE, **sent)[0] == 403


def test_tunnel_with_another_port_is_refused_with_the_reason(explorer):
    port = port_of(explorer)
    advice = f"ssh -L {port}:127.0.0.1:{port} NAME"
    status, text = answer(explorer.address, Host=f"localhost:{port + 1}")
    assert (status, text.count("\n")) == (403, 1)
    assert advice in text
    assert advice in explorer._repr_html_()
    assert answer(explorer.address.replace("127.0.0.1", "localhost"))[0] == 200
    with socket.socket() as other:  # the server listens on this machine only
        other.settimeout(5)
        assert other.connect_ex(("127.0.0.2", port)) != 0


def test_page_is_reachable_through_a_jupyterhub(monkeypatch):
    """jupyter-server-proxy serves it below the path of the user, and passes on the headers of the browser."""
    monkeypatch.setenv("JUPYTERHUB_SERVICE_PREFIX", "/user/name/")
    with closing(vd.explore(threads=1)) as explorer:
        path, _, page = explorer.address.partition("/?")
        place, _, port = path.rpartition("/")
        assert place == "/user/name/proxy"
        assert f'src="{explorer.address}"' in explorer._repr_html_()
        assert "jupyter-server-proxy" in explorer._repr_html_()
        here, hub = f"http://127.0.0.1:{port}/?{page}", "hub.example.org"
        assert answer(here, Host=hub)[0] == 200
        assert answer(here, Host=hub, Origin=f"https://{hub}")[0] == 200
        assert answer(here, Host=hub, Origin="https://evil.example")[0] == 403
        assert answer(here.partition("?")[0], Host=hub)[0] == 403
        socket = {**UPGRADE, "Host": hub}
        for origin, code in ((f"https://{hub}", 101), ("https://evil.example", 403)):
            with closing(HTTPConnection("127.0.0.1", int(port), timeout=LIMIT)) as connection:  # urllib upgrades none
                connection.request("GET", f"/ws?{page}", headers={**socket, "Origin": origin})
                assert connection.getresponse().status == code


def test_each_message_is_answered_or_refused_in_one_line(explorer):
    """No message ends the connection: the page always receives an answer."""

    async def ask(*messages):
        socket = await websocket_connect(explorer.address.replace("http", "ws").replace("/?", "/ws?"))
        for message in messages:
            await socket.write_message(message)
            found = json.loads(await socket.read_message())
            while "compiling" in found:
                found = json.loads(await socket.read_message())
            assert "\n" not in found["refused"]
        await socket.write_message('{"seq": 1, "ping": true}')
        assert json.loads(await socket.read_message()) == {}
        socket.close()

    wrong = ["", "[]", '{"seq": 1}', '{"seq": "x"}', '{"seq": 1, "address": "y=9"}']
    asyncio.run(ask(*wrong, '{"seq": 1, "view": {"low": "<b>"}}'))


def test_page_that_closes_while_it_is_sent_a_picture_is_no_error():
    """tornado reports it in the future of the message, which asyncio prints if nobody looks at it."""
    errors = []

    async def send():
        asyncio.get_running_loop().set_exception_handler(lambda loop, told: errors.append(told))
        page = SimpleNamespace(write_message=lambda *content, binary: asyncio.ensure_future(closed()))
        Session._write(page, "{}")
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        gc.collect()

    async def closed():
        raise WebSocketClosedError

    asyncio.run(send())
    assert errors == []


@pytest.mark.parametrize("body", ["Content-Length: 90000000\r\n\r\n", "Transfer-Encoding: chunked\r\n\r\n55d4a80\r\n"])
@pytest.mark.parametrize("token", ["x", "{token}"])
def test_no_body_of_a_request_is_read(explorer, token, body):
    """The connection ends although the body of 90 MB has not been sent."""
    path = f"/?token={token.format(token=explorer.address.partition('token=')[2])}"
    with socket.create_connection(("127.0.0.1", port_of(explorer)), timeout=60) as connection:
        connection.sendall(f"POST {path} HTTP/1.1\r\nHost: 127.0.0.1:{port_of(explorer)}\r\n{body}".encode())
        told = b"".join(iter(lambda: connection.recv(4096), b""))
    assert told.startswith(b"HTTP/1.1 400 ")


def started(*arguments, **environment):
    """Return the process of `vibrodrive explore` and the address that it prints."""
    process = subprocess.Popen(
        [sys.executable, "-m", "vibrodrive", "explore", *arguments], env=os.environ | environment,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    return process, process.stdout.readline().strip()


BROWSER = """
import os, sys, time, urllib.request
command = os.getppid()
print(urllib.request.urlopen(sys.argv[2]).status, file=open(sys.argv[1], "w"), flush=True)
while os.getppid() == command:
    time.sleep(0.05)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="displays of Linux")
@pytest.mark.parametrize("display", ["DISPLAY", "WAYLAND_DISPLAY", ""])
def test_browser_in_the_foreground_shows_the_page_if_there_is_a_display(display, tmp_path, monkeypatch):
    """The server serves while the command of BROWSER runs. Without a display no browser is started."""
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    (tmp_path / "browser.py").write_text(BROWSER)
    (tmp_path / "shown").touch()
    browser = f"{sys.executable} {tmp_path / 'browser.py'} {tmp_path / 'shown'} %s"
    process, address = started("--port", "0", BROWSER=browser, **({display: ":0"} if display else {}))
    try:
        assert answer(address)[0] == 200
        while display and (tmp_path / "shown").read_text() != "200\n":
            assert process.poll() is None
            time.sleep(0.05)
    finally:
        process.kill()
        process.communicate()
    assert display or (tmp_path / "shown").read_text() == ""


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_signal_ends_the_command_and_a_port_in_use_is_refused(explorer):
    process, address = started("--no-browser")
    try:
        assert answer(address)[0] == 200
        process.send_signal(signal.SIGINT)
        _, complaint = process.communicate(timeout=LIMIT)
        assert (process.returncode, complaint.count("\n"), "Traceback" in complaint) == (130, 1, False)
    finally:
        process.kill()
        process.wait()
    process, address = started("--no-browser", "--port", str(port_of(explorer)))
    _, complaint = process.communicate(timeout=LIMIT)
    assert (process.returncode, address, complaint.count("\n")) == (2, "", 1)
    assert complaint.startswith(f"vibrodrive: --port {port_of(explorer)}: ")


def test_port_is_fixed_unless_it_is_in_use(monkeypatch):
    from vibrodrive.explorer import server

    with socket.create_server(("127.0.0.1", 0)) as found:
        usual = found.getsockname()[1]
    monkeypatch.setattr(server, "PORT", usual)
    with closing(vd.explore(threads=1)) as first, closing(vd.explore(threads=1)) as second:
        assert [answer(explorer.address)[0] for explorer in (first, second)] == [200, 200]
        assert port_of(first) == usual != port_of(second)
    with closing(vd.explore(threads=1)) as again:
        assert port_of(again) == usual


def test_failure_prints_no_token(explorer, monkeypatch, capfd):
    def fails(*arguments):
        raise RuntimeError("no page today")

    monkeypatch.setattr("vibrodrive.explorer.server.build", fails)
    answer(explorer.address)
    written = "".join(capfd.readouterr())
    assert explorer.address.partition("token=")[2] not in written
    assert "Traceback" not in written


@pytest.mark.parametrize("link", ["http://127.0.0.1:6283/?low=3.0&eps=0.0002", "?low=3.0&eps=0.0002"])
def test_command_opens_a_link_without_its_token(link, monkeypatch):
    from vibrodrive.explorer.server import Explorer

    seen = []
    monkeypatch.setattr(Explorer, "run", lambda explorer: (seen.append(explorer.view), explorer.close()))
    explore.main(["--no-browser", "--port", "0", link], standalone_mode=False)
    assert [(view.low, view.eps) for view in seen] == [(3.0, 2e-4)]


def test_kept_token_makes_a_link_work_in_the_next_run(tmp_path):
    file = tmp_path / "token"
    tokens = []
    for _ in range(2):
        process, address = started("--no-browser", "--port", "0", "--token", str(file))
        try:
            assert answer(address)[0] == 200
            tokens.append(address.partition("token=")[2])
        finally:
            process.kill()
            process.communicate()
    assert tokens[0] == tokens[1] == file.read_text().strip()
    assert os.name != "posix" or file.stat().st_mode & 0o777 == 0o600


@pytest.mark.skipif(os.name != "posix", reason="modes of files")
@pytest.mark.parametrize(
    ("content", "mode", "allowed"),
    [("x" * 30, 0o644, "only its owner may read"), ("short", 0o600, "at least 20"), ("a b" * 20, 0o600, "at least 20")],
)
def test_file_that_others_may_read_or_without_a_token_is_refused(tmp_path, content, mode, allowed):
    from vibrodrive.explorer.server import kept_token

    file = tmp_path / "token"
    file.write_text(content)
    file.chmod(mode)
    with pytest.raises(ValueError, match=allowed) as caught:
        kept_token(file)
    assert content not in str(caught.value)


def test_wrong_token_is_told_how_to_get_the_right_one(explorer):
    status, told = answer(explorer.address[:-1])
    assert status == 403
    assert "Open the address that `vibrodrive explore` has printed" in told
    assert "--token FILE" in told


def test_supplied_picture_is_that_of_the_first_view():
    """Its dots are where the first view has values, and nowhere else."""
    from vibrodrive.explorer.controls import title_of
    from vibrodrive.explorer.server import build
    from vibrodrive.explorer.view import View

    known = json.loads(re.search(r'id="known">(.*?)</script>', build(View(), ""), re.DOTALL)[1])
    ((head, arrays),) = messages(known["stored"])
    assert (head["title"], head["conditions"]) == title_of(View())
    rows, columns = arrays["image"].shape
    found = vd.sweep(A=np.linspace(2.2, 5.0, columns), section_phase=np.pi / 2, transient=500, periods=256)
    spots = np.zeros((rows, columns), bool)
    row = np.floor((found.section[..., 1] - head["y"]) / head["dh"] * rows).astype(int)
    spots[row, np.arange(columns)[:, None]] = True
    spots[np.minimum(row + 1, rows - 1), np.arange(columns)[:, None]] = True
    assert np.array_equal(spots, arrays["image"] > 0)
    assert json.loads(re.search(r'id="known">(.*?)</script>', build(View(eps=1e-4), ""), re.DOTALL)[1])["stored"] == []
