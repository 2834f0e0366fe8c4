"""`vibrodrive explore`: interactive diagrams in the browser."""

from __future__ import annotations

import gc
from importlib.util import find_spec
from pathlib import Path

import click

from vibrodrive.cli.common import FILE, METHOD, SET, THREADS, read


@click.command()
@click.argument("config", type=FILE, required=False)
@click.option("--port", type=click.IntRange(0, 65535), help="Port; 0: any free port (default 6283, or any if in use).")
@click.option("--no-browser", is_flag=True, help="Print the address, and open no browser.")
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
    """Show interactive diagrams in the browser.

    The first diagram is that of CONFIG, if it is given. This command needs the extra `explore`.

    Output: the address of the page on stdout. The page is reachable from this machine only. Ctrl-C stops the server.
    """
    if find_spec("bokeh") is None:
        raise click.ClickException("explore needs the extra: pip install 'vibrodrive[explore]'")
    if config is None and (overrides or method):
        raise click.ClickException("--set and --method change a configuration: give CONFIG, or leave them out")
    gc.disable()  # imports create no garbage, and collection takes a tenth of the time to the first picture
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
    """Enable garbage collection again, without the objects that exist now."""
    if not gc.isenabled():
        gc.freeze()
        gc.enable()
