"""The server of the page: on this machine alone, for whoever knows the token.

Bokeh compares the origin of a websocket with a list. Here every request is judged, before anything answers it: its
Host must be a name of this machine (a foreign name that resolves to it would let a foreign page in), its Origin, if it
has one, must be this server, and what is no static file must bring the token. A websocket brings the signed session
that the page with the token was given.
"""

from __future__ import annotations

import hmac
import logging
import secrets
import socket
from collections.abc import Callable
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
from tornado.httputil import HTTPServerRequest
from tornado.ioloop import IOLoop
from tornado.iostream import IOStream
from tornado.web import RequestHandler

from vibrodrive.explorer.engine import Engine
from vibrodrive.explorer.session import Session
from vibrodrive.explorer.view import View

ADDRESS = "127.0.0.1"
HOST_NAMES = (ADDRESS, "localhost")
PORT = 6283
"""Port of the page unless it is taken (1000 · 2π): a browser keeps the compiled scripts of a port for the next page."""


class Refusal(RequestHandler):
    """The answer to what is refused."""

    def initialize(self, why: str) -> None:
        self.why = why

    def prepare(self) -> None:
        self.set_status(403)
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish(self.why + "\n")


class Guarded(BokehTornado):
    """Bokeh's application behind a check of every request."""

    def __init__(self, applications: Any, token: str, port: int, **options: Any) -> None:
        self.token = token
        self.hosts = {f"{name}:{port}" for name in HOST_NAMES}
        super().__init__(applications, **options)

    def find_handler(self, request: HTTPServerRequest, **kwargs: Any) -> Any:
        why = self.refusal(request)
        if why:
            return self.get_handler_delegate(request, Refusal, {"why": why})
        return super().find_handler(request, **kwargs)

    def resources(self, absolute_url: str | bool | None = None) -> Resources:
        """What the page is made of, without Bokeh's tables, formulas and drawing by the graphics card."""
        return super().resources(absolute_url).clone(components=["bokeh", "bokeh-widgets"])

    def refusal(self, request: HTTPServerRequest) -> str:
        """Why a request is refused, "" if it is not."""
        if request.host not in self.hosts:
            return "refused: this server answers to its own address only"
        origin = request.headers.get("Origin") or request.headers.get("Sec-WebSocket-Origin")
        if origin is not None and origin.removeprefix("http://") not in self.hosts:
            return "refused: a page of another origin has asked"
        if request.path.startswith("/static/") or request.path == "/favicon.ico":
            return ""
        given = b"".join(request.query_arguments.get("token", [])[:1])
        if not hmac.compare_digest(given, self.token.encode()):
            return "refused: wrong token: replace it by the one in the address that vibrodrive explore has printed"
        return ""


class Prompt(HTTPServer):
    """A server that sends what it has at once: a picture comes in several parts, and each small one would wait for the
    browser to acknowledge the one before, 40 ms later."""

    def handle_stream(self, stream: IOStream, address: Any) -> None:
        stream.set_nodelay(True)
        stream.set_nodelay = lambda value: None  # type: ignore[method-assign]  # else taken back after the first request
        super().handle_stream(stream, address)


def _tasks() -> Any:
    from vibrodrive.explorer import tasks  # brings Numba, for which a page does not wait

    return tasks


def _listening(port: int | None) -> socket.socket:
    if port is None:
        with suppress(OSError):
            return socket.create_server((ADDRESS, PORT))
    return socket.create_server((ADDRESS, port or 0))


class Explorer:
    """A running explorer. `address` is what to open; `run` serves until it is interrupted, `close` ends it.

    A page shows `view` unless its address says otherwise. `port` 0 is any that is free; None is PORT, or any if that is
    taken. `imported` is called from another thread, perhaps repeatedly, when the code that computes has been imported.
    Raises OSError for a port that is not available, ValueError if there are not so many threads.
    """

    def __init__(
        self,
        view: View,
        port: int | None = None,
        threads: int | None = None,
        imported: Callable[[], object] | None = None,
    ) -> None:
        for chatty in ("bokeh", "tornado"):  # what users are to know is said on the page
            logging.getLogger(chatty).setLevel(logging.ERROR)
        if threads is not None:
            from vibrodrive.batch.sweep import check_threads  # brings Numba, for which the page does not wait

            check_threads(threads)
        listening = _listening(port)
        self.engine = Engine(threads, _tasks, imported)
        self.token = secrets.token_urlsafe(24)
        self.view = view
        application = Application(FunctionHandler(self._open))
        listening.setblocking(False)
        self.port: int = listening.getsockname()[1]
        tornado = Guarded(
            {"/": application},
            self.token,
            self.port,
            extra_websocket_origins=[f"{name}:{self.port}" for name in HOST_NAMES],
            secret_key=secrets.token_bytes(32),
            sign_sessions=True,
            generate_session_ids=True,
            check_unused_sessions_milliseconds=500,  # a closed page ends its work
            unused_session_lifetime_milliseconds=2000,
            websocket_compression_level=1,
        )
        self.http = Prompt(tornado)
        self.http.add_sockets([listening])
        self.server = BaseServer(IOLoop.current(), tornado, self.http)
        self.server.start()

    @property
    def address(self) -> str:
        """Of the page, with its token."""
        return f"http://{ADDRESS}:{self.port}/?token={self.token}"

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
        self.server.io_loop.close(all_fds=True)  # a page whose connection is cut notices

    def close(self) -> None:
        """End what is computed, and the server; from any thread."""
        self.engine.close()
        self.server.io_loop.add_callback(self._end)

    def _end(self) -> None:
        self.server.stop(wait=False)
        self.http.stop()
        self.server.io_loop.stop()
