"""What is asked of each file, by which function it is answered, and the key under which an answer is kept."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cache, cached_property
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from typing import Any, TypeAlias

Row: TypeAlias = dict[str, Any]
"""What one file said, by the names of a table's columns: text, finite numbers, truths, lists of these, None."""


@dataclass(frozen=True)
class Question:
    """The same for every file. It crosses to other processes and machines, so it holds words and numbers only."""

    table: str
    """Where the rows go: `fits`."""
    place: str
    """`module:function` that answers: (path, options) -> Row. It knows no engine."""
    options: Mapping[str, Any]
    """What it is asked with, as JSON has it."""
    version: str
    """Of all that has a say in the answer (`rig.workers.version`)."""

    @cached_property
    def asked(self) -> str:
        """Twelve hexadecimal digits of table and options."""
        return _digest(self.table, self.place, json.dumps(self.options, sort_keys=True))[:12]

    def key(self, recording: str) -> str:
        """Of the answer for a recording, `recording` being the SHA-256 of its file: recording, options and version."""
        return _digest(recording, self.asked, self.version)

    def as_json(self) -> dict[str, Any]:
        return asdict(self)


def _digest(*texts: str) -> str:
    return sha256("\n".join(texts).encode()).hexdigest()


def software(question: Question) -> str:
    """Name, version, and the version of the sources that answer.

    >>> software(Question("fits", "rig.fit.one:answer", {}, "0123456789ab")).endswith(", sources 0123456789ab")
    True
    """
    return f"thruster-rig {_known()}, sources {question.version}"


@cache
def _known() -> str:
    try:
        return version("thruster-rig")
    except PackageNotFoundError:
        return "(not installed)"
