"""The equations of a model as a person copies them: each with whose it is, a long comment on lines of its own."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from textwrap import wrap

from identification.mismatch.diagnosis import Equation

TITLE = "The model, to type in (numpy's names; units as recorded; d(x)/dt from x(0) on, in steps of 1 ms):"


def typed(equations: Sequence[Equation], width: int) -> Iterator[str]:
    """Lines of at most `width` columns, where the equations themselves are no longer.

    >>> list(typed([Equation("F = F + 0.2 * x", "linear_term"), Equation("thrust = F + tare  # N")], 28))
    ['# linear_term', 'F = F + 0.2 * x', 'thrust = F + tare  # N']
    """
    for e in equations:
        line, _, comment = e.line.partition("  # ")
        told = ": ".join(part for part in (e.effect, comment) if part)
        beside = f"{line}  # {told}" if told else line
        if len(beside) <= width:
            yield beside
        else:
            yield from wrap(told, width, initial_indent="# ", subsequent_indent="# ")
            yield line
