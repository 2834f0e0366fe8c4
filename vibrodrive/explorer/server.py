"""Server of the page, reachable from this machine only and protected by a token.

This server checks every request before any handler sees it:

- The Host header must be a name of this machine. Otherwise a foreign page could gain access through a foreign host
  name that resolves to this machine.
- The Origin header, if there is one, must name this server.
- On a JupyterHub these two headers must agree, because the name of the hub is unknown. The requests come from the hub,
  which has asked for the login of the user.
- Every request must contain the token.

A request with a body is answered with status 400 before its body is read, because the page sends none.
"""

from __future__ import annotations

import hmac
import logging
import os
import re
import secrets
import socket
from contextlib import suppress
from pathlib import Path
from typing import Any

from tornado.httpserver import HTTPServer
from tornado.httputil import HTTPServerRequest
from tornado.ioloop import IOLoop
from tornado.web import Application, RequestHandler

from vibrodrive.explorer.controls import build
from vibrodrive.explorer.engine import Engine
from vibrodrive.explorer.session import Session, refusal
from vibrodrive.explorer.view import View, read_address
from vibrodrive.model import parameters

ADDRESS = "127.0.0.1"
HOST_NAMES = (ADDRESS, "localhost")
PORT = 6283
"""Default port of the page, 1000 · 2π. With the same port in each run a browser remembers what is open on the page."""

HEADERS = {
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",  # because the address contains the token
    "X-Content-Type-Options": "nosniff",
    # frames are allowed in a notebook on this machine, at any port, and in the web view of an editor
    "Content-Security-Policy": "frame-ancestors http://localhost:* http://127.0.0.1:* vscode-webview: "
    "https://*.vscode-cdn.net 'self'",  # 'self': in a notebook of a JupyterHub
}


RIGHT = """Open the address that `vibrodrive explore` has printed. Its token is new in every run, unless the command was
`vibrodrive explore --token FILE`: then a link works tomorrow, too.""".replace("\n", " ")


def kept_token(path: Path) -> str:
    """Return the token in a file, which is created if there is none. Raises OSError, and ValueError for a file that
    others may read, or that contains no token."""
    with suppress(FileExistsError), open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
        file.write(secrets.token_urlsafe(24).encode())
    if os.name == "posix" and path.stat().st_mode & 0o077:
        raise ValueError(parameters.bad("--token", str(path), "a file that only its owner may read: chmod 600"))
    token = path.read_text(encoding="utf-8").strip()
    if not re.fullmatch(r"[\w-]{20,}", token, re.ASCII):
        raise ValueError(parameters.bad("--token", str(path), "a file with at least 20 letters, digits, - and _"))
    return token


class Page(RequestHandler):
    """The page, which also contains its scripts, with the view of its address or, if there is none, the first view. A
    refused request has the status 403 and the reason."""

    def set_default_headers(self) -> None:
        for name, value in HEADERS.items():
            self.set_header(name, value)

    def initialize(self, engine: Engine, base: View, why: str = "") -> None:
        self.engine, self.base, self.why = engine, base, why

    def prepare(self) -> None:
        if self.why:
            self.set_status(403)
            self.set_header("Content-Type", "text/plain; charset=utf-8")
            self.finish(self.why + "\n")

    def get(self) -> None:
        view, refused = self.base, None
        if set(self.request.query_arguments) != {"token"}:
            try:
                view = read_address(self.request.query)
            except ValueError as error:
                refused = refusal(error)
        self.finish(build(view, refused))
        self.engine.warm()


class Guarded(Application):
    """Application that checks every request."""

    def __init__(self, common: dict[str, Any], token: str, port: int, hub: str) -> None:
        self.common, self.token, self.port, self.hub = common, token, port, hub
        self.hosts = [f"{name}:{port}" for name in HOST_NAMES]
        super().__init__([("/", Page, common), ("/ws", Session, common)])

    def find_handler(self, request: HTTPServerRequest, **kwargs: Any) -> Any:
        why = self.refusal(request)
        if why:
            return self.get_handler_delegate(request, Page, {**self.common, "why": why})
        return super().find_handler(request, **kwargs)

    def refusal(self, request: HTTPServerRequest) -> str:
        """Return the reason to refuse a request, or "" to accept it."""
        hosts = [request.host] if self.hub else self.hosts
        if request.host not in hosts:
            return "refused: " + parameters.bad("Host", request.host, f"{' or '.join(hosts)}; {tunnel(self.port)}")
        origin = request.headers.get("Origin") or request.headers.get("Sec-WebSocket-Origin")
        schemes = ("http", "https") if self.hub else ("http",)
        if origin is not None and origin not in [f"{scheme}://{host}" for scheme in schemes for host in hosts]:
            return "refused: the request comes from a page of another origin"
        given = b"".join(request.query_arguments.get("token", [])[:1])
        if not hmac.compare_digest(given, self.token.encode()):
            return f"refused: wrong or missing token. {RIGHT}"
        return ""


def tunnel(port: int) -> str:
    """Return the advice for a browser on another machine."""
    return f"a tunnel must have the same port at both ends: ssh -L {port}:{ADDRESS}:{port} NAME"


def _tasks() -> Any:
    from vibrodrive.explorer import tasks  # imports Numba; imported here so that the page appears sooner

    return tasks


def _listening(port: int | None) -> socket.socket:
    if port is None:
        with suppress(OSError):
            return socket.create_server((ADDRESS, PORT))
    return socket.create_server((ADDRESS, port or 0))


class Explorer:
    """Running explorer at the URL `address`. `run` serves until `close` is called or the program is interrupted.

    The address of a page may contain a view; otherwise the page shows `view`. `port` 0 means any free port; None means
    PORT, or any free port if PORT is in use. Raises OSError if the port is not available.
    """

    def __init__(self, view: View, port: int | None = None, threads: int | None = None, token: str = "") -> None:
        logging.getLogger("tornado").setLevel(logging.CRITICAL)  # a traceback here would contain the token
        listening = _listening(port)
        self.view, self.engine = view, Engine(threads, _tasks)
        self.token = token or secrets.token_urlsafe(24)
        self.hub = os.environ.get("JUPYTERHUB_SERVICE_PREFIX", "")
        listening.setblocking(False)
        self.port: int = listening.getsockname()[1]
        common = {"engine": self.engine, "base": view}
        self.http = HTTPServer(Guarded(common, self.token, self.port, self.hub), max_body_size=0)
        self.http.add_sockets([listening])
        self.loop = IOLoop.current()

    @property
    def address(self) -> str:
        """Address of the page, including the token. On a JupyterHub it begins with the path on the hub."""
        place = f"{self.hub}proxy/{self.port}" if self.hub else f"http://{ADDRESS}:{self.port}"
        return f"{place}/?token={self.token}"

    @property
    def advice(self) -> str:
        """What to do if the browser cannot show the page at `address`."""
        if self.hub:
            return "the page needs the package jupyter-server-proxy beside the Jupyter server of this JupyterHub"
        return f"if the browser runs on another machine, {tunnel(self.port)}"

    def run(self) -> None:
        """Serve until `close` is called."""
        self.loop.start()
        self.loop.close(all_fds=True)  # closes the connections, so that open pages notice the end

    def close(self) -> None:
        """End the computation and the server. May be called from any thread."""
        self.engine.worker.close()
        self.loop.add_callback(self._end)

    def _end(self) -> None:
        self.http.stop()
        self.loop.stop()
