"""`vibrodrive explore`: interactive diagrams in the browser."""

import os
import sys
import threading
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

import click

from vibrodrive.cli.common import FILE, in_one_line, judge_slip, read, say


@click.command()
@click.argument("config", type=FILE, required=False)
@click.option(
    "--port",
    type=click.IntRange(0, 65535),
    help="Port of the page; 0 selects any free port (default: 6283, or any free port if 6283 is in use).",
)
@click.option(
    "--token",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="File with the token of the address, created if there is none: a link to the page then works in later runs.",
)
@click.option("--no-browser", is_flag=True, help="Print the address, and open no browser.")
def explore(config: Path | None, port: int | None, token: Path | None, no_browser: bool) -> None:
    """Show interactive diagrams in the browser.

    CONFIG is a configuration, or a link that the page has saved. The page then begins with the view of CONFIG. This
    command needs the extra `explore`: pip install 'vibrodrive[explore]'.

    Output: the address of the page on stdout. The page is reachable from this machine only. Ctrl-C stops the server. On
    Linux without a display no browser is opened.
    """
    if find_spec("tornado") is None:
        raise click.ClickException("explore needs the extra `explore`: pip install 'vibrodrive[explore]'")
    from vibrodrive.explorer.controls import title_of
    from vibrodrive.explorer.view import View, read_address, view_of

    view = View()
    with in_one_line():
        if config is not None and "?" in config.name and not config.exists():
            view = read_address(config.name.partition("?")[2])
        elif config is not None:
            settings = read(config)
            judge_slip(settings)
            view = view_of(settings)
            say(f"shows {', '.join(title_of(view))}")
    from vibrodrive.explorer.server import Explorer, kept_token

    with in_one_line():
        try:
            chosen = "" if token is None else kept_token(token)
        except OSError as error:
            raise click.ClickException(f"--token {token}: {error.strerror}") from None
    try:
        explorer = Explorer(view, port, token=chosen)
    except OSError as error:
        why = (error.strerror or str(error)).partition(" (")[0]
        raise click.ClickException(f"{'no free port' if port is None else f'--port {port}'}: {why}") from None
    click.echo(explorer.address)
    if explorer.hub:
        say(f"open this path on the hub; {explorer.advice}")
    elif not no_browser and (sys.platform != "linux" or {"DISPLAY", "WAYLAND_DISPLAY"} & os.environ.keys()):
        explorer.loop.add_callback(threading.Thread(target=_show, args=(explorer.address,), daemon=True).start)
    explorer.run()


def _show(address: str) -> None:
    """Open a browser. This takes as long as the browser runs, if it runs in the foreground (BROWSER=command)."""
    import webbrowser

    with suppress(Exception):  # the address is printed
        webbrowser.open(address)
