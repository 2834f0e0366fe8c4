"""What the docstrings of all public figures say alike: the arguments `ax`, `style` and `width`, and what comes back."""

from __future__ import annotations

import inspect
import re

PARAMETERS = """\
ax : Axes or sequence of Axes, optional
    where to draw, one for each panel; a new figure unless given.
style : "screen" or "print", optional
    colours that the colour-blind tell apart, or the black and white of a journal; "screen" unless given.
width : "double" or "single", optional
    of a new figure: for two columns of a page, at most 174 mm, or for one, 84 mm; "double" unless given."""

RETURNS = """\
Returns
-------
Figure
    of Matplotlib, which shows itself in a notebook; `savefig` writes it. That of `ax`, if given."""

RAISES = """\
ValueError
    for an unknown style or width, and unless `ax` is one Axes for each panel."""

HEADING = re.compile(r"\n\n(?=[A-Z]\w+\n-+\n)")


def with_shared(text: str) -> str:
    """A docstring with Parameters, in the form of NumPy, completed by what all figures share; another one as it is."""
    head, *sections = HEADING.split(inspect.cleandoc(text))
    named = {section.partition("\n")[0]: section for section in sections}
    if "Parameters" not in named:
        return text
    parameters, raises = named.pop("Parameters"), named.pop("Raises", "Raises\n------")
    return "\n\n".join([head, f"{parameters}\n{PARAMETERS}", RETURNS, f"{raises}\n{RAISES}", *named.values()]) + "\n"
