"""The columns of a table of rows: names, kinds, units; those that every table has."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, slots=True)
class Column:
    """One column. `kind`: of its values, `texts` a list of text; `parts`: of a list of structures, their fields."""

    name: str
    kind: Literal["text", "number", "whole", "truth", "texts", "structures"] = "text"
    unit: str = ""
    parts: tuple[Column, ...] = ()


COMMON = (
    Column("thruster"),
    Column("serial", "whole"),
    Column("recording_id"),
    Column("created"),
    Column("url"),
    Column("sha256"),
    Column("error"),
    Column("software"),
    Column("asked"),
    Column("options"),
)
"""Whose, of which recording, from where; why there is no answer; by which program, asked how."""
