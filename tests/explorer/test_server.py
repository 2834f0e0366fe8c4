"""The server accepts only requests of this machine, with the token, and from its own pages. No test needs a browser."""

import os
import re
import signal
import socket
import subprocess
import sys
import urllib.error
import urllib.request
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from http.client import HTTPConnection

import numba
import pytest

pytest.importorskip("bokeh")

import vibrodrive as vd
from tests.support.process import python
from vibrodrive.cli.explore import explore

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


def test_page_is_served_with_the_token(explorer):
    status, text = answer(explorer.address)
    assert status == 200
    assert "<title>vibrodrive explore</title>" in text
    assert "cdn.bokeh.org" not in text  # no resource comes from another server
    scripts = re.findall(r"static/js/([\w-]+)\.min\.js", text)
    assert scripts == ["bokeh"]  # no script that the page does not use


def test_pages_are_not_cached_and_framed_by_this_machine_only(explorer):
    for address in (explorer.address, explorer.address.partition("?")[0]):
        try:
            response = urllib.request.urlopen(address, timeout=LIMIT)
        except urllib.error.HTTPError as error:
            response = error
        with response:
            headers = response.headers
        assert headers["Cache-Control"] == "no-store"
        assert headers["Referrer-Policy"] == "no-referrer"
        assert headers["Content-Security-Policy"].startswith("frame-ancestors http://localhost:* http://127.0.0.1:*")
    base = explorer.address.partition("?")[0]
    with urllib.request.urlopen(base + "static/js/bokeh.min.js", timeout=LIMIT) as response:
        assert response.headers["Cache-Control"] != "no-store"  # browsers may store scripts


def test_page_is_built_without_numba_and_matplotlib():
    script = """if True:
        import sys
        from bokeh.document import Document
        import vibrodrive.explorer.server
        from vibrodrive.explorer.layout import build
        from vibrodrive.explorer.view import View
        build(Document(), View.read({"eps": 1e-4}), "")
        print(*{"numba", "matplotlib", "h5py"} & set(sys.modules))
    """
    assert python(script).split() == []


def test_notebook_and_its_explorer_do_not_import_numba_at_once():
    """`vd.explore` imports Numba before it returns. Two imports at the same time in two threads could fail."""
    script = """if True:
        import sys
        import vibrodrive as vd
        explorer = vd.explore()
        print("numba" in sys.modules)
        explorer.close()
    """
    assert python(script) == "True\n"


def test_explorer_uses_the_number_of_threads_set_in_numba():
    """Numba keeps this number for each thread, and the explorer computes in another one."""

    def ask():
        numba.set_num_threads(1)
        with closing(vd.explore()) as explorer:
            return explorer._explorer.engine.threads

    with ThreadPoolExecutor(1) as pool:
        assert pool.submit(ask).result() == 1


@pytest.mark.parametrize(
    "path", ["/", "/?token=", "/?token=x&token={token}", "/autoload.js", "/metadata", "/?low=3", "/nowhere", "/ws"]
)
def test_no_path_is_served_without_the_token(explorer, path):
    base, _, token = explorer.address.partition("/?token=")
    status, text = answer(base + path.format(token=token))
    assert (status, text.count("\n")) == (403, 1)
    assert "token" in text


@pytest.mark.parametrize(
    "headers",
    [
        {"Host": "evil.example"},
        {"Host": "evil.example:80"},
        {"Host": "127.0.0.1"},
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Origin": "https://127.0.0.1:{port}"},
    ],
)
def test_foreign_hosts_and_origins_are_refused_even_with_the_token(explorer, headers):
    port = port_of(explorer)
    sent = {k: v.format(port=port) for k, v in headers.items()}
    assert answer(explorer.address, **sent)[0] == 403
    assert answer(explorer.address.split("?")[0] + "static/js/bokeh.min.js", **sent)[0] == 403


def test_tunnel_with_another_port_is_refused_with_the_reason(explorer):
    port = port_of(explorer)
    status, text = answer(explorer.address, Host=f"localhost:{port + 1}")
    assert status == 403
    assert text == (
        f"refused: Host = 'localhost:{port + 1}': must be 127.0.0.1:{port} or localhost:{port}; "
        f"a tunnel must have the same port at both ends: ssh -L {port}:127.0.0.1:{port} NAME\n"
    )
    assert f"ssh -L {port}:127.0.0.1:{port} NAME" in explorer._repr_html_()


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
        status, text = answer(here, Host=hub)
        assert status == 200
        assert re.findall(r'src="([^"]*)static/js', text) == ["./"]
        assert answer(here, Host=hub, Origin=f"https://{hub}")[0] == 200
        assert answer(here, Host=hub, Origin="https://evil.example")[0] == 403
        assert answer(here.partition("?")[0], Host=hub)[0] == 403
        session = re.search(r'"token":"([^"]+)"', text)[1]
        socket = {**UPGRADE, "Sec-WebSocket-Protocol": f"bokeh, {session}", "Host": hub}
        for origin, code in ((f"https://{hub}", 101), ("https://evil.example", 403)):
            with closing(HTTPConnection("127.0.0.1", int(port), timeout=LIMIT)) as connection:  # urllib upgrades none
                connection.request("GET", f"/ws?{page}", headers={**socket, "Origin": origin})
                assert connection.getresponse().status == code


def test_localhost_is_accepted(explorer):
    assert answer(explorer.address.replace("127.0.0.1", "localhost"))[0] == 200


@pytest.mark.parametrize(("origin", "token"), [("http://evil.example", ""), (None, ""), ("own", "e30.forged")])
def test_websocket_needs_the_session_of_a_page(explorer, origin, token):
    base = explorer.address.split("/?")[0]
    headers = {**UPGRADE, "Sec-WebSocket-Protocol": f"bokeh, {token}"}
    if origin:
        headers["Origin"] = base if origin == "own" else origin
    assert answer(base + "/ws", **headers)[0] == 403
    with_token = explorer.address.replace("/?", "/ws?")
    assert answer(with_token, **headers)[0] in (400, 401, 403)


def test_server_listens_on_this_machine_only(explorer):
    port = port_of(explorer)
    with socket.socket() as other:
        other.settimeout(5)
        assert other.connect_ex(("127.0.0.2", port)) != 0


def started(*arguments):
    """Return the process of `vibrodrive explore` and the address that it prints."""
    process = subprocess.Popen(
        [sys.executable, "-m", "vibrodrive", "explore", "--no-browser", *arguments],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    return process, process.stdout.readline().strip()


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_signal_ends_the_command():
    process, address = started()
    try:
        assert answer(address)[0] == 200
        process.send_signal(signal.SIGINT)
        _, complaint = process.communicate(timeout=LIMIT)
        assert process.returncode == 130
        assert complaint.count("\n") == 1
        assert "Traceback" not in complaint
    finally:
        process.kill()
        process.wait()


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

    monkeypatch.setattr("vibrodrive.explorer.server.Session", fails)
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


def test_port_in_use_is_refused_in_one_line(explorer):
    port = port_of(explorer)
    process, address = started("--port", str(port))
    _, complaint = process.communicate(timeout=LIMIT)
    assert (process.returncode, address) == (2, "")
    assert complaint.startswith(f"vibrodrive: --port {port}: ")
    assert complaint.count("\n") == 1
