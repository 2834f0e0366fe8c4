"""`vd.explore`: the explorer in a notebook or from a Python session."""

from __future__ import annotations

import asyncio
import html
import threading
from concurrent.futures import Future
from importlib.util import find_spec
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from vibrodrive.explorer.view import View, view_of
from vibrodrive.model import config as configuration
from vibrodrive.model import parameters

if TYPE_CHECKING:
    from vibrodrive.explorer.server import Explorer


FRAME = 'allow="fullscreen; clipboard-write" style="border: 0"'


class Explored:
    """Running explorer. A notebook shows its page in a frame. A browser opens its `address`.

    The address is a URL on this machine or, on a JupyterHub, the path of the page on the hub.
    """

    def __init__(self, view: View, threads: int) -> None:
        started: Future[Explorer] = Future()
        self._thread = threading.Thread(target=_serve, args=(view, threads, started), name="explorer page", daemon=True)
        self._thread.start()
        self._explorer = started.result()
        self.address = self._explorer.address

    def close(self) -> None:
        """End the explorer."""
        self._explorer.close()
        self._thread.join(2.0)

    def _repr_html_(self) -> str:
        address = html.escape(self.address)
        frame = f'<iframe src="{address}" width="100%" height="860" {FRAME}></iframe>'
        return (
            f'{frame}<p><a href="{address}" target="_blank">Page in a tab</a>; {html.escape(self._explorer.advice)}</p>'
        )

    def __repr__(self) -> str:
        return f"<explorer at {self.address}>"


@parameters.with_sentences
def explore(config: str | PathLike[str] | None = None, *, threads: int | None = None) -> Explored:
    """Show interactive diagrams in a notebook, or in a browser at the returned address.

    Parameters
    ----------
    config : path, optional
        configuration of the first view; by default a diagram over A.
    threads : int, optional
        number of threads of the computation; by default the number of threads of Numba (`numba.set_num_threads`).

    Returns
    -------
    Explored
        the running explorer, with `address` and `close`. The page is reachable from this machine only, and on a
        JupyterHub through the hub (with jupyter-server-proxy), until `close` is called or the process ends.

    Raises
    ------
    ConfigError, TypeError, ValueError
        if the configuration cannot be read or shown; the message has one line.
    ModuleNotFoundError
        if the extra `explore` is not installed.

    Examples
    --------
    >>> import vibrodrive as vd
    >>> explorer = vd.explore()
    >>> explorer.address.startswith("http://127.0.0.1:")
    True
    >>> explorer.close()
    """
    if find_spec("tornado") is None:
        raise ModuleNotFoundError("explore needs the extra `explore`: pip install 'vibrodrive[explore]'")
    if not isinstance(config, str | PathLike | None):
        raise TypeError(parameters.bad("config", config, "the name of a configuration"))
    view = View.read({}) if config is None else view_of(configuration.read(Path(config)))
    from vibrodrive.batch import sweep
    from vibrodrive.explorer import tasks  # noqa: F401 - imports Numba; if two threads import it, one may fail

    return Explored(view, sweep.check_threads(threads))


def _serve(view: View, threads: int, started: Future[Explorer]) -> None:
    """Serve in this thread, with a separate event loop, because a notebook already runs an event loop."""
    from vibrodrive.explorer.server import Explorer

    try:
        asyncio.set_event_loop(asyncio.new_event_loop())
        explorer = Explorer(view, threads=threads)
    except BaseException as error:
        started.set_exception(error)
        return
    started.set_result(explorer)
    explorer.run()
