"""Files of a fleet: which are meant, what tells one from another, and how one comes to hand.

A name is a path, a folder for its *.h5, or a pattern (`*`, `?`, `**` for folders below); or a URL of any of these.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from glob import has_magic
from hashlib import file_digest
from pathlib import Path

from rig.errors import RecordingError
from rig.fleet.elsewhere import fetched, is_url, named_by, sha256_of_url, stamp_of_url
from rig.hdf5.opening import require_file

RACY = 2_000_000_000
"""ns: a file that was written so shortly before it was looked at may be written again within the same stamp."""


def meant(names: Iterable[str], ending: str = ".h5") -> list[str]:
    """Absolute paths in the order given, each once; of folders and patterns sorted. Raises RecordingError."""
    found = list(dict.fromkeys(url for name in names for url in _meant(name, ending)))
    if not found:
        raise RecordingError(f"no file was given; expected files, folders or patterns of *{ending}")
    return found


def _meant(name: str, ending: str) -> list[str]:
    if is_url(name):
        return named_by(name, ending)
    path = Path(name)
    if path.is_dir():
        found = sorted(path.glob(f"*{ending}"))
        if not found:
            raise RecordingError(f"{path} is a folder without files; expected *{ending} in it")
        return [_absolute(each) for each in found]
    if not path.exists() and has_magic(name):
        matching = sorted(each for each in _matching(path) if each.is_file())
        if not matching:
            raise RecordingError(f"no file is called {name}; a pattern must match one at least")
        return [_absolute(each) for each in matching]
    require_file(path)
    return [_absolute(path)]


def _matching(pattern: Path) -> Iterator[Path]:
    """From the deepest folder that the pattern names."""
    parts = pattern.parts
    depth = next(at for at, part in enumerate(parts) if has_magic(part))
    return Path(*parts[:depth]).glob("/".join(parts[depth:]))


def _absolute(path: Path) -> str:
    found = str(path.absolute())
    try:
        found.encode()
    except UnicodeEncodeError:
        raise RecordingError(f"{path}: this name is no UTF-8, which a table needs; rename the file") from None
    return found


def stamp_of(url: str, now_ns: int) -> str:
    """Changes when the file does, without a look into it; empty where that can't be told: look into it.

    `now_ns`: by the clock of the day. Raises RecordingError.
    """
    if is_url(url):
        return stamp_of_url(url)
    try:
        found = Path(url).stat()
    except OSError as error:
        raise RecordingError(f"{url} can't be read: {error.strerror}") from None
    if now_ns - max(found.st_mtime_ns, found.st_ctime_ns) < RACY:
        return ""
    return f"{found.st_size} {found.st_mtime_ns} {found.st_ino}"


def sha256_of(path: str | Path) -> str:
    """Of a file's bytes, in hexadecimal. Raises OSError."""
    if isinstance(path, str) and is_url(path):
        return sha256_of_url(path)
    with Path(path).open("rb") as file:
        return file_digest(file, "sha256").hexdigest()


@contextmanager
def at_hand(url: str) -> Iterator[Path]:
    """The file as a path of this machine, as long as it is needed. Raises OSError."""
    if is_url(url):
        with fetched(url) as path:
            yield path
    else:
        yield Path(url)
