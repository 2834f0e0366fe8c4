"""Server of the page, reachable from this machine only and protected by a token.

Bokeh checks only the origin of a websocket. This server checks every request before any handler sees it:

- The Host header must be a name of this machine. Otherwise a foreign page could gain access through a foreign host
  name that resolves to this machine.
- The Origin header, if there is one, must name this server.
- On a JupyterHub these two headers must agree, because the name of the hub is unknown. The requests come from the hub,
  which has asked for the login of the user.
- Every request except those for static files must contain the token. A websocket must also present the signed
  session that the page with the token has received.
"""

from __future__ import annotations

import hmac
import logging
import os
import secrets
import socket
from contextlib import suppress
from typing import Any
from urllib.parse import urlencode

from bokeh.application import Application
from bokeh.application.handlers.function import FunctionHandler
from bokeh.document import Document
from bokeh.resources import Resources
from bokeh.server.server import BaseServer
from bokeh.server.tornado import BokehTornado
from tornado.httpserver import HTTPServer
from tornado.httputil import HTTPHeaders, HTTPServerRequest
from tornado.ioloop import IOLoop
from tornado.iostream import IOStream
from tornado.web import OutputTransform, RequestHandler

from vibrodrive.explorer.engine import Engine
from vibrodrive.explorer.session import Session
from vibrodrive.explorer.view import View
from vibrodrive.model.parameters import bad

ADDRESS = "127.0.0.1"
HOST_NAMES = (ADDRESS, "localhost")
PORT = 6283
"""Default port of the page, 1000 · 2π. With the same port in each run a browser reuses stored scripts."""

SPINS = "10000"
"""Number of times that an idle thread of GNU's OpenMP looks for work before it sleeps, about 20 µs. By default it looks
for milliseconds, during which it takes a core from the browser, which then draws a third fewer pictures."""


class Refusal(RequestHandler):
    """Handler of refused requests: status 403 and the reason."""

    def initialize(self, why: str) -> None:
        self.why = why

    def prepare(self) -> None:
        self.set_status(403)
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish(self.why + "\n")


HEADERS = {
    "Referrer-Policy": "no-referrer",  # because the address contains the token
    "X-Content-Type-Options": "nosniff",
    # frames are allowed in a notebook on this machine, at any port, and in the web view of an editor
    "Content-Security-Policy": "frame-ancestors http://localhost:* http://127.0.0.1:* vscode-webview: "
    "https://*.vscode-cdn.net 'self'",  # 'self': in a notebook of a JupyterHub
}


class Headers(OutputTransform):
    """Add HEADERS to each response, and allow browsers to store static files only."""

    def __init__(self, request: HTTPServerRequest) -> None:
        super().__init__(request)
        self.fixed = request.path.startswith("/static/")

    def transform_first_chunk(
        self, status_code: int, headers: HTTPHeaders, chunk: bytes, finishing: bool
    ) -> tuple[int, HTTPHeaders, bytes]:
        for name, value in HEADERS.items():
            headers[name] = value
        if not self.fixed:
            headers["Cache-Control"] = "no-store"
        return status_code, headers, chunk


class Guarded(BokehTornado):
    """Bokeh application that checks every request."""

    def __init__(self, applications: Any, token: str, port: int, hub: str, **options: Any) -> None:
        self.token, self.port, self.hub = token, port, hub
        self.hosts = [f"{name}:{port}" for name in HOST_NAMES]
        origins = ["*"] if hub else self.hosts  # `refusal` has compared the origin before
        super().__init__(applications, extra_websocket_origins=origins, **options)
        self.add_transform(Headers)

    def find_handler(self, request: HTTPServerRequest, **kwargs: Any) -> Any:
        why = self.refusal(request)
        if why:
            return self.get_handler_delegate(request, Refusal, {"why": why})
        return super().find_handler(request, **kwargs)

    def resources(self, absolute_url: str | bool | None = None) -> Resources:
        """Return the scripts of the page. They omit Bokeh's widgets, tables, formulas and WebGL.

        Their addresses are relative to the page, because a hub serves both below its own path.
        """
        return super().resources(absolute_url or "./").clone(components=["bokeh"])

    def refusal(self, request: HTTPServerRequest) -> str:
        """Return the reason to refuse a request, or "" to accept it."""
        hosts = [request.host] if self.hub else self.hosts
        if request.host not in hosts:
            return "refused: " + bad("Host", request.host, f"{' or '.join(hosts)}; {tunnel(self.port)}")
        origin = request.headers.get("Origin") or request.headers.get("Sec-WebSocket-Origin")
        schemes = ("http", "https") if self.hub else ("http",)
        if origin is not None and origin not in [f"{scheme}://{host}" for scheme in schemes for host in hosts]:
            return "refused: the request comes from a page of another origin"
        if request.path.startswith("/static/") or request.path == "/favicon.ico":
            return ""
        given = b"".join(request.query_arguments.get("token", [])[:1])
        if not hmac.compare_digest(given, self.token.encode()):
            return "refused: wrong or missing token; use the token of the address that vibrodrive explore has printed"
        return ""


def tunnel(port: int) -> str:
    """Return the advice for a browser on another machine."""
    return f"a tunnel must have the same port at both ends: ssh -L {port}:{ADDRESS}:{port} NAME"


class Prompt(HTTPServer):
    """Server that sends each part of a picture without delay (TCP_NODELAY).

    Otherwise each small part waits until the browser has acknowledged the previous one, about 40 ms.
    """

    def handle_stream(self, stream: IOStream, address: Any) -> None:
        stream.set_nodelay(True)
        stream.set_nodelay = lambda value: None  # type: ignore[method-assign]  # Tornado would reset it
        super().handle_stream(stream, address)


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
    PORT, or any free port if PORT is in use. Raises OSError if the port is not available, and ValueError for too many
    threads.
    """

    def __init__(self, view: View, port: int | None = None, threads: int | None = None) -> None:
        for chatty in ("bokeh", "tornado"):  # errors appear on the page; a traceback here would contain the token
            logging.getLogger(chatty).setLevel(logging.CRITICAL)
        if threads is not None:
            from vibrodrive.batch.sweep import check_threads  # imports Numba, so that the page would appear later

            check_threads(threads)
        listening = _listening(port)
        os.environ.setdefault("GOMP_SPINCOUNT", SPINS)  # read when the first sweep starts the threads
        self.engine = Engine(threads, _tasks)
        self.token = secrets.token_urlsafe(24)
        self.view = view
        self.hub = os.environ.get("JUPYTERHUB_SERVICE_PREFIX", "")
        application = Application(FunctionHandler(self._open))
        listening.setblocking(False)
        self.port: int = listening.getsockname()[1]
        tornado = Guarded(
            {"/": application},
            self.token,
            self.port,
            self.hub,
            secret_key=secrets.token_bytes(32),
            sign_sessions=True,
            generate_session_ids=True,
            check_unused_sessions_milliseconds=500,  # so that the work of a closed page ends soon
            unused_session_lifetime_milliseconds=2000,
            websocket_compression_level=1,
        )
        self.http = Prompt(tornado)
        self.http.add_sockets([listening])
        self.server = BaseServer(IOLoop.current(), tornado, self.http)
        self.server.start()

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

    def _open(self, document: Document) -> None:
        context = document.session_context
        given = context.request.arguments if context is not None and context.request is not None else {}
        address = urlencode([(key, v.decode(errors="replace")) for key, values in given.items() for v in values[:1]
                             if key != "token" and not key.startswith("bokeh")])  # fmt: skip
        Session(document, self.engine, self.view, address, self.token)
        self.engine.warm()

    def run(self) -> None:
        """Serve until `close` is called."""
        self.server.io_loop.start()
        self.server.io_loop.close(all_fds=True)  # closes the connections, so that open pages notice the end

    def close(self) -> None:
        """End the computation and the server. May be called from any thread."""
        self.engine.close()
        self.server.io_loop.add_callback(self._end)

    def _end(self) -> None:
        self.server.stop(wait=False)
        self.http.stop()
        self.server.io_loop.stop()
