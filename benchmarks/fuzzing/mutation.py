"""Sound input into input that is not: a plain mutator with a seed, so that every failure can be had again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

SPITE = (
    b"9" * 310, b"-" + b"9" * 310, b"1e999", b"nan", b"inf", b"-0.0", b"1e-320", b"9223372036854775808",
    b"\x00", b"\xff\xfe",
    b"\x1b]0;owned\x07", b"\xe2\x80\xae", b"[" * 2000, b"{a=" * 2000, b'"' * 3, b"a." * 300, b"\r", b"\n\n",
    b"/dev/zero",
    b"../../x", b"[/x]", b"\xc2\x9b31m",
)  # fmt: skip
"""What parsers and terminals have stumbled over."""


@dataclass
class Tally:
    """What became of the inputs; the ones that hurt are kept as files."""

    what: str
    folder: Path
    outcomes: dict[str, int] = field(default_factory=dict)
    hurt: list[str] = field(default_factory=list)
    longest: float = 0.0
    """s"""

    def add(self, outcome: str, seconds: float = 0.0) -> None:
        self.outcomes[outcome] = self.outcomes.get(outcome, 0) + 1
        self.longest = max(self.longest, seconds)

    def fail(self, name: str, why: str, data: bytes) -> None:
        """Keep the input; say where it is and what it did."""
        self.folder.mkdir(parents=True, exist_ok=True)
        path = self.folder / name
        path.write_bytes(data)
        self.hurt.append(f"{path}: {why}")
        self.add("HURT")

    def summary(self) -> str:
        counts = ", ".join(f"{count} {name}" for name, count in sorted(self.outcomes.items()))
        longest = f"; the longest took {self.longest:.2f} s" if self.longest else ""
        return "\n".join([f"{self.what}: {counts}{longest}", *(f"  {line}" for line in self.hurt[:20])])


def mutant(rng: np.random.Generator, seeds: Sequence[bytes]) -> bytes:
    """One of the seeds with one to four changes."""
    data = bytearray(seeds[int(rng.integers(len(seeds)))])
    for _ in range(min(int(rng.geometric(0.6)), 4)):
        _change(rng, data, seeds)
    return bytes(data)


def _change(rng: np.random.Generator, data: bytearray, seeds: Sequence[bytes]) -> None:
    at = int(rng.integers(len(data) + 1))
    n = int(rng.integers(1, max(len(data) // 8, 2)))
    match int(rng.integers(8)):
        case 0:
            for place in rng.integers(max(len(data), 1), size=4) if data else ():
                data[place] ^= 1 << int(rng.integers(8))
        case 1:
            del data[at : at + n]
        case 2:
            data[at:at] = bytes(rng.integers(256, size=min(n, 64), dtype=np.uint8))
        case 3:
            data[at:at] = SPITE[int(rng.integers(len(SPITE)))]
        case 4:
            data[at : at + n] = bytes(len(data[at : at + n]))
        case 5:
            data[at:at] = data[at : at + n]
        case 6:
            other = seeds[int(rng.integers(len(seeds)))]
            start = int(rng.integers(len(other) + 1))
            data[at : at + n] = other[start : start + n]
        case _:
            _other_number(rng, data)


def _other_number(rng: np.random.Generator, data: bytearray) -> None:
    """A digit somewhere becomes something that may be a number."""
    digits = [i for i, byte in enumerate(data[:20_000]) if 48 <= byte <= 57]
    if digits:
        at = digits[int(rng.integers(len(digits)))]
        data[at : at + 1] = SPITE[int(rng.integers(8))]
