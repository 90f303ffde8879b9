"""Lines of a table in plain text, whose columns are as wide as what stands in them: nothing runs together."""

from __future__ import annotations

from collections.abc import Sequence

GAP = 2
"""Blanks between two columns at least."""


def laid_out(rows: Sequence[Sequence[str]], layout: str) -> list[str]:
    r"""A line for each row, blanks at its end cut. `layout`: of each column its side and its least width.

    >>> print("\n".join(laid_out([("starboard aft", "123456.7", "N"), ("C", "0.4", "N/V^2")], "<9 >7 <4")))
      starboard aft    123456.7  N
      C                     0.4  N/V^2
    """
    columns = [(word[0], int(word[1:])) for word in layout.split()]
    widths = [max(least, *(len(row[k]) + GAP for row in rows)) for k, (_, least) in enumerate(columns)]
    return [_line(row, [side for side, _ in columns], widths) for row in rows]


def _line(row: Sequence[str], sides: Sequence[str], widths: Sequence[int]) -> str:
    line, before = "  ", "<"
    for cell, side, width in zip(row, sides, widths, strict=True):
        if side == "<" and before == ">":
            line += " " * GAP
        line += f"{cell:{side}{width}}"
        before = side
    return line.rstrip()
