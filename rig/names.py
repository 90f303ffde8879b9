"""Names of thrusters, campaigns, benches and devices: they become files, groups of a recording and arguments of a mount
command, and are shown on terminals. So they are names, and nothing else.
"""

from __future__ import annotations

from pathlib import Path

from rig.errors import ConfigError, RecordingError

LONGEST = 100
"""Bytes in UTF-8; a file name has 255, and the rig adds a number and an ending."""


def why_no_name(text: str) -> str:
    r"""What keeps `text` from being a name; empty when it is one.

    >>> why_no_name("T1 (left, 2026)")
    ''
    >>> why_no_name("../../x")
    "has a '/' in it"
    >>> why_no_name("T1\x1b]0;")
    "has the unprintable character '\\x1b' in it"
    """
    if not text.strip():
        return "is empty"
    unprintable = next((letter for letter in text if not letter.isprintable()), None)
    if unprintable is not None:
        return f"has the unprintable character {unprintable!r} in it"
    separator = next((letter for letter in "/\\" if letter in text), None)
    if separator is not None:
        return f"has a {separator!r} in it"
    if text != text.strip() or text[0] in ".-":
        return f"begins with {text[0]!r}" if text[0] in ".- " else "ends with a space"
    return f"is longer than {LONGEST} bytes" if len(text.encode()) > LONGEST else ""


def require_name(path: Path, key: str, text: str) -> None:
    """Raises ConfigError that names file, key and fault."""
    if fault := why_no_name(text):
        raise ConfigError(
            f"{path}: {key} is {text[:60]!r}, which {fault}: expected a plain name, at most {LONGEST} bytes, without "
            "path separators and control characters, not beginning with a dot or a dash"
        )


def file_inside(folder: Path, name: str, ending: str) -> Path:
    """`<folder>/<name><ending>`. Raises RecordingError for what is no name: it might lie elsewhere."""
    if fault := why_no_name(name):
        raise RecordingError(f"a file of {folder} can't be called {name[:60]!r}: that {fault}")
    return folder / f"{name}{ending}"
