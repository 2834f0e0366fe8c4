"""`vibrodrive init`: begin with one of the configurations that come with the program."""

from __future__ import annotations

from pathlib import Path

import click

from vibrodrive.cli.common import FILE, say


@click.command()
@click.argument("name", required=False)
@click.option("-o", "--output", type=FILE, help="Where to write it (default NAME.toml, here).")
def init(name: str | None, output: Path | None) -> None:
    """Write the configuration NAME, with comments, to begin with. Without NAME: list all that there are.

    A file that is there is never replaced.
    """
    from vibrodrive.model.packaged import configurations, titles
    from vibrodrive.model.parameters import bad

    known = titles()
    if name is None:
        if output is not None:
            raise click.ClickException(bad("output", str(output), "given with the NAME of a configuration"))
        wide = max(map(len, known))
        for each, title in known.items():
            click.echo(f"{each:<{wide}}  {title}")
        return
    if name not in known:
        raise click.ClickException(bad("name", name, "one of " + ", ".join(known)))
    target = output or Path(f"{name}.toml")
    text = (configurations() / f"{name}.toml").read_text(encoding="utf-8")
    # comments name this and other configurations as they lie in a checkout
    text = text.replace(f"configs/{name}.toml", str(target)).replace("configs/", "")
    with open(target, "x") as file:
        file.write(text)
    say(f"{target} written:{_commands(text)}")


def _commands(text: str) -> str:
    """What a configuration's comments say it is for: the lines that begin with a command."""
    return "".join(f"\n{line[1:]}" for line in text.splitlines() if line.startswith("#   vibrodrive "))
