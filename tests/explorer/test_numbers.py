"""Numbers and expressions that users type into the page."""

import math

import pytest

from vibrodrive.explorer.numbers import number_of
from vibrodrive.explorer.view import View


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("0,0002", 2e-4), ("1/5000", 2e-4), ("pi/2", math.pi / 2), ("10*sqrt(102)", 10 * math.sqrt(102)),
        ("2^-3", 0.125), ("−1,5e-3", -1.5e-3), (" 3.04 ", 3.04), ("(1+2)*3", 9.0), ("2π", None),
    ],
)  # fmt: skip
def test_expressions_of_numbers(text, value):
    if value is None:
        with pytest.raises(ValueError, match="not an expression of numbers"):
            number_of(text)
    else:
        assert number_of(text) == value


@pytest.mark.parametrize(
    "text",
    ["", "x", "__import__('os')", "().__class__", "9**9**9**9", "1/0", "[1]", "sqrt(-1)", "sqrt(2, 3)", "True",
     "lambda: 1", "1;2", "(" * 2000, "1" * 101 + "+1", "1j"],
)  # fmt: skip
def test_other_expressions_are_refused(text):
    with pytest.raises(ValueError):  # noqa: PT011 - View.read replaces the message
        number_of(text)


def test_view_evaluates_expressions_and_names_the_limits_of_a_count():
    assert View.read({"eps": "1/5000", "section_phase": "pi/2"}).eps == 2e-4
    for columns in (1, 5000):
        with pytest.raises(ValueError, match=f"columns = {columns}: must be an integer from 2 to 4000"):
            View.read({"columns": str(columns)})
