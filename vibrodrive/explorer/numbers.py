"""Numbers and expressions that users type: `0,0002`, `1/5000`, `pi/2`, `10*sqrt(102)`."""

from __future__ import annotations

import ast
import math
import operator
import re
from collections.abc import Callable
from contextlib import suppress

LONGEST = 100  # largest number of characters of an expression
OPERATORS: dict[type[ast.AST], Callable[..., float]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.Pow: math.pow, ast.USub: operator.neg, ast.UAdd: operator.pos,
}  # fmt: skip
CONSTANTS = {"pi": math.pi, "π": math.pi}
FUNCTIONS = {"sqrt": math.sqrt}


def number_of(text: str) -> float:
    """Return the value of a number or of an expression of numbers, + - * / ** ^ ( ), pi and sqrt. Raises ValueError.

    A comma is a decimal point. The text is only parsed; Python never evaluates it.
    """
    with suppress(ValueError):
        return float(text)
    if len(text) > LONGEST:
        raise ValueError("too long")
    written = re.sub(r"(?<=\d),(?=\d)", ".", text.strip()).replace("^", "**").replace("−", "-")
    try:
        return _value(ast.parse(written, mode="eval").body)
    except (SyntaxError, ArithmeticError, RecursionError, MemoryError):
        raise ValueError("not an expression of numbers") from None


def _value(node: ast.AST) -> float:
    match node:
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            return float(value)
        case ast.Name(id=name) if name in CONSTANTS:
            return CONSTANTS[name]
        case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATORS:
            return OPERATORS[type(op)](_value(left), _value(right))
        case ast.UnaryOp(op=op, operand=operand) if type(op) in OPERATORS:
            return OPERATORS[type(op)](_value(operand))
        case ast.Call(func=ast.Name(id=name), args=[argument], keywords=[]) if name in FUNCTIONS:
            return FUNCTIONS[name](_value(argument))
    raise ValueError("not an expression of numbers")
