"""Session of one open page. It passes the requests of the page to the worker, and sends messages to the page.

The page sends JSON. It receives JSON (`news`), or arrays in binary form (`send`): the length of the head as an int32,
the head as JSON with the type, the shape and the place of each array, and the arrays.
"""

from __future__ import annotations

import base64
import html
import itertools
import json
import struct
import zlib
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np
from tornado.ioloop import IOLoop
from tornado.websocket import WebSocketClosedError, WebSocketHandler

from vibrodrive.explorer.engine import Engine
from vibrodrive.explorer.view import COLUMNS, MOST_COLUMNS, PICTURE_ROWS, View, adapted, read_address

if TYPE_CHECKING:
    from vibrodrive.explorer.work import Work

NUMBERS = itertools.count(1)


class Session(WebSocketHandler):
    """Connection of a page, from opening to closing. "Start over" restores the view `base`."""

    def initialize(self, engine: Engine, base: View) -> None:
        self.engine, self.base = engine, base
        self.number = next(NUMBERS)
        self.work: Work | None = None
        self.made_from: list[str] = []
        self.view, self.seq, self.asked = base, 0, 0  # numbers of the last message, and of the last one for a picture
        self.pixels = COLUMNS, PICTURE_ROWS  # width and height of the picture in the page
        self.painted = 0  # number of the request whose complete picture the page shows
        self.moving, self.rests = "", False  # the plan of the motion that the page shows, and whether it rests for ever

    def check_origin(self, origin: str) -> bool:
        return True  # the server has compared the origin before

    def get_compression_options(self) -> dict[str, Any]:
        return {"compression_level": 1}

    def open(self, *arguments: str) -> None:
        self.set_nodelay(True)  # otherwise each part of a picture waits until the browser has acknowledged the previous
        self.loop = IOLoop.current()
        self.engine.pages[self.number] = self

    def on_close(self) -> None:
        self.engine.worker.cancel(self.number)
        self.engine.worker.cancel(-self.number)
        self.engine.pages.pop(self.number, None)

    def later(self, change: Callable[[], None]) -> None:
        """Call `change` in the thread of the server."""
        self.loop.add_callback(change)

    def on_message(self, message: str | bytes) -> None:
        """Answer a message of the page. Every error is reported, so that the page can send the next message."""
        try:
            asked = json.loads(message)
            self.seq = int(asked["seq"])
            if asked.get("pixels"):
                width, height = (min(MOST_COLUMNS, max(2, int(length))) for length in asked["pixels"])
                self.pixels = width, height
            self._answer(asked)
        except Exception as error:
            self.refuse(error)

    def _answer(self, asked: Mapping[str, Any]) -> None:
        if asked.get("ping"):
            self.news({"compiling": seconds} if (seconds := round(self.engine.compiling())) else {})
        elif asked.get("reset"):
            self.news({"apply": self.base.state()})
        elif "address" in asked:
            self.news({"apply": read_address(asked["address"]).state()})
        elif "changed" in asked:
            self.news({"apply": adapted(asked["view"], asked["changed"]).state()})
        elif asked.get("toml"):
            self.news({"toml": View.read(asked["view"]).sized(*self.pixels).toml()})
        elif asked.get("save"):
            view = View.read(asked["view"])
            self.engine.worker.request(-self.number, lambda halt: self.engine.tasks().save(self, view, halt))
        else:
            self.view = view = View.read(asked["view"])
            self.asked = self.asked if asked.get("only_motion") else self.seq
            about = {"view": asked["view"], "address": view.address(), "done": self.seq, "seq": self.asked}
            sized = view.sized(*self.pixels)
            self.engine.worker.request(self.number, lambda halt: self.engine.tasks().answer(self, sized, about, halt))

    def refuse(self, error: BaseException) -> None:
        self.news({"refused": one_line(error), "done": self.seq})

    def news(self, news: Mapping[str, Any]) -> None:
        """Send these values to the page."""
        self._write(json.dumps(news))

    def send(self, kind: str, head: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> None:
        """Send arrays to the page."""
        self._write(message_of(kind, head, arrays))

    def _write(self, content: str | bytes) -> None:
        with suppress(WebSocketClosedError):
            sent = self.write_message(content, binary=isinstance(content, bytes))
            sent.add_done_callback(lambda sent: sent.cancelled() or sent.exception())  # the page may be closed by then


def message_of(kind: str, head: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> bytes:
    """Return a message with arrays, each at a multiple of 8 bytes."""
    places, parts, at = {}, [], 0
    for name, array in arrays.items():
        places[name] = array.dtype.str[1:], array.shape, at
        part = np.ascontiguousarray(array).tobytes()
        parts.append(part + bytes(-len(part) % 8))
        at += len(parts[-1])
    text = json.dumps({**head, "kind": kind, "arrays": places}).encode()
    text += b" " * (-(len(text) + 4) % 8)
    return b"".join([struct.pack("<i", len(text)), text, *parts])


def stored(message: bytes) -> str:
    """Return a message as compressed text, which a page contains."""
    return base64.b64encode(zlib.compress(message, 9)).decode()


def one_line(error: BaseException) -> str:
    return html.escape(" ".join(str(error).split()) or type(error).__name__)
