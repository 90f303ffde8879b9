"""Expressions over columns: numbers, names, + - * /, abs(), sign() and sqrt(). Nothing else can be written or run."""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np

from identification.recording import Floats
from rig.errors import ConfigError

BINARY: Final[Mapping[type[ast.operator], Callable[[Any, Any], Any]]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: np.divide,
}
UNARY: Final[Mapping[type[ast.unaryop], Callable[[Any], Any]]] = {ast.USub: operator.neg, ast.UAdd: operator.pos}
LONGEST: Final = 400
MOST_BRACKETS: Final = 40
MOST: Final = 1e30
"""No number of a conversion is larger, and whole ones stay floats whatever is done with them."""
FUNCTIONS: Final[Mapping[str, Callable[[Any], Any]]] = {
    "abs": np.abs,
    "sign": np.sign,
    "sqrt": lambda x: np.sqrt(np.where(np.asarray(x) < 0, np.nan, x)),
}


def names_in(text: str) -> tuple[str, ...]:
    """Names an expression uses, in order. Raises ConfigError for what is no such expression.

    >>> names_in("sign(pwm - 1500) * rpm / 60")
    ('pwm', 'rpm')
    """
    found: dict[str, None] = {}
    _check(_parsed(text), text, found)
    return tuple(found)


def evaluate(text: str, values: Mapping[str, Floats | float]) -> Floats:
    """Value of an expression; a division by zero gives NaN, for nothing was measured there.

    >>> evaluate("2 * a / b", {"a": np.array([1.0, 2.0]), "b": np.array([4.0, 0.0])}).tolist()
    [0.5, nan]
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        out = np.asarray(_value(_parsed(text), values), dtype=np.float64)
    return np.where(np.isfinite(out), out, np.nan)


def _parsed(text: str) -> ast.expr:
    if len(text) > LONGEST or text.count("(") > MOST_BRACKETS:
        raise ConfigError(
            f"expression {text[:40]!r}...: {len(text)} letters; at most {LONGEST} and {MOST_BRACKETS} brackets are read"
        )
    try:
        return ast.parse(text, mode="eval").body
    except (SyntaxError, ValueError) as error:
        reason = error.msg if isinstance(error, SyntaxError) else error
        raise ConfigError(f"expression {text!r}: {reason}; write for example `(pwm - 1500) / 400`") from error


def _check(node: ast.expr, text: str, found: dict[str, None]) -> None:
    match node:
        case ast.Constant(value=int() | float() as number) if not isinstance(number, bool) and abs(number) < MOST:
            pass
        case ast.Name(id=name):
            found[name] = None
        case ast.BinOp(left=left, op=op, right=right) if type(op) in BINARY:
            _check(left, text, found)
            _check(right, text, found)
        case ast.UnaryOp(op=op, operand=operand) if type(op) in UNARY:
            _check(operand, text, found)
        case ast.Call(func=ast.Name(id=name), args=[argument], keywords=[]) if name in FUNCTIONS:
            _check(argument, text, found)
        case _:
            raise ConfigError(
                f"expression {text!r}: {ast.unparse(node)!r} is not allowed; "
                "only numbers, names, + - * /, abs(x), sign(x), sqrt(x)"
            )


def _value(node: ast.expr, values: Mapping[str, Floats | float]) -> Any:
    match node:
        case ast.Constant(value=int() | float() as number):
            return float(number)
        case ast.Name(id=name):
            return values[name]
        case ast.BinOp(left=left, op=op, right=right):
            return BINARY[type(op)](_value(left, values), _value(right, values))
        case ast.UnaryOp(op=op, operand=operand):
            return UNARY[type(op)](_value(operand, values))
        case ast.Call(func=ast.Name(id=name), args=[argument]):
            return FUNCTIONS[name](_value(argument, values))
    raise TypeError(f"{ast.dump(node)} passed the check")
