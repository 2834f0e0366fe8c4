"""`vibrodrive explore`: diagrams under the mouse, in the browser."""

from __future__ import annotations

import gc
from importlib.util import find_spec
from pathlib import Path

import click

from vibrodrive.cli.common import FILE, METHOD, SET, THREADS, read


@click.command()
@click.argument("config", type=FILE, required=False)
@click.option("--port", type=click.IntRange(0, 65535), help="Port to serve on; 0: any (default 6283, or any if taken).")
@click.option("--no-browser", is_flag=True, help="Open no browser: only print the address.")
@SET
@METHOD
@THREADS
def explore(
    config: Path | None,
    port: int | None,
    no_browser: bool,
    overrides: tuple[str, ...],
    method: str | None,
    threads: int | None,
) -> None:
    """Explore diagrams in the browser, from what CONFIG describes on, if it is given.

    The address that is printed leads to it, from this machine alone. Ctrl-C ends it.
    """
    if find_spec("bokeh") is None:
        raise click.ClickException("explore needs the extra: pip install 'vibrodrive[explore]'")
    if config is None and (overrides or method):
        raise click.ClickException("--set and --method change a configuration, and none is given")
    gc.disable()  # nothing imported is garbage: to look for some takes a tenth of the time to the first picture
    from vibrodrive.explorer.view import View, view_of

    try:
        view = View() if config is None else view_of(read(config, overrides, method))
    except ValueError as error:
        raise click.ClickException(str(error)) from None
    from vibrodrive.explorer.server import Explorer

    try:
        explorer = Explorer(view, port, threads, _collect_garbage)
    except ValueError as error:
        raise click.ClickException(f"--{error}") from None
    except OSError as error:
        why = (error.strerror or str(error)).partition(" (")[0]
        raise click.ClickException(f"{'no free port' if port is None else f'--port {port}'}: {why}") from None
    click.echo(explorer.address)
    if not no_browser:
        import webbrowser

        webbrowser.open(explorer.address)
    explorer.run()


def _collect_garbage() -> None:
    """Look for garbage again, but not among what there is by now."""
    if not gc.isenabled():
        gc.freeze()
        gc.enable()
