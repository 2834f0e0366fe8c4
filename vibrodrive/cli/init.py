"""`vibrodrive init`: list the supplied configurations, or write one of them."""

from pathlib import Path

import click

from vibrodrive.cli.common import say


@click.command()
@click.argument("name", required=False)
def init(name: str | None) -> None:
    """List the supplied configurations, or write one of them.

    Without NAME: print the name and title of each configuration.

    With NAME: write the configuration NAME.toml, with comments, and print the commands that use it. An existing file is
    not replaced.
    """
    from vibrodrive.model.packaged import configurations, titles
    from vibrodrive.model.parameters import bad, unknown

    supplied, name = titles(), name and name.removesuffix(".toml")
    if name is None:
        wide = max(map(len, supplied), default=0)
        for each, title in supplied.items():
            click.echo(f"{each:<{wide}}  {title}")
        return
    if name not in supplied:
        raise click.ClickException(unknown("name", name, supplied))
    target = Path(f"{name}.toml")
    text = (configurations() / f"{name}.toml").read_text(encoding="utf-8")
    # comments contain the paths of configurations in a checkout
    text = text.replace(f"configs/{name}.toml", str(target)).replace("configs/", "")
    try:
        with open(target, "x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise click.ClickException(bad("output", str(target), "a new file, because this file exists")) from None
    commands = [f"\n{line[1:]}" for line in text.splitlines() if line.startswith("#   vibrodrive ")]
    say(f"{target} written:{''.join(commands)}")
