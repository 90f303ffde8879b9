"""Lines of a SCPI instrument: commands to bytes, answers to numbers.

Source: SCPI-99 volume 1 (6.1 headers, 7.1 numbers) and IEEE 488.2 (`*IDN?`, `*CLS`). A command ends with LF, an answer
with LF or CR LF; an answer does not say which question it answers.
"""

from __future__ import annotations

import math
import re

_NUMBER = re.compile(r"[+-]?(?:\d{1,20}\.?\d{0,20}|\.\d{1,20})(?:[eE][+-]?\d{1,3})?")
_ERROR = re.compile(r'([+-]?\d{1,6})\s*,?\s*"?([^"]*)"?')


def encode(command: str) -> bytes:
    """A command as the instrument wants it. Raises ValueError for what is none."""
    if not command.isascii() or not command.isprintable() or not command.strip():
        raise ValueError(f"a SCPI command is printable ASCII, not {command!r}")
    return command.encode("ascii") + b"\n"


def number(text: str) -> float | None:
    """An answer as a number, `V` or `A` behind it or not; `ON` is 1 and `OFF` 0; None: it is none."""
    words = text.strip()
    if words.upper() in ("ON", "OFF"):
        return float(words.upper() == "ON")
    bare = words.rstrip("VAva ")
    if _NUMBER.fullmatch(bare) is None:
        return None
    value = float(bare)
    return value if math.isfinite(value) else None


def error(text: str) -> tuple[int, str] | None:
    """An answer to `SYST:ERR?`, as number and words; None: it is none."""
    found = _ERROR.fullmatch(text.strip())
    return None if found is None else (int(found[1]), found[2].strip())


def setting(command: str) -> tuple[str, float]:
    """`OUTP:PROT:WDOG:DEL 1` as its question and what is to be read back. Raises ValueError for what cannot be."""
    header, _, value = command.strip().partition(" ")
    expected = number(value)
    if not header or expected is None:
        raise ValueError(f"a setting is a header and a number, ON or OFF, such as 'OUTP:PROT:WDOG ON', not {command!r}")
    return f"{header}?", expected
