"""Files by URL (`s3://`, `https://`, `zip://*.h5::file:///a.zip` ...) as fsspec reads them: listed and fetched.

A file is fetched whole: range reads of a live recording's layout move several times of it (`rig pack` makes one that
is read in parts).
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from errno import EIO
from hashlib import sha256
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from rig.errors import ConfigError, RecordingError

PIECE = 1 << 20
"""Bytes that are read at once."""
TOLD_BY = ("ETag", "etag", "md5Hash", "mtime", "LastModified", "last_modified", "updated")
"""What file systems call that which changes with a file."""


def is_url(name: str) -> bool:
    """Whether a name is of a file elsewhere.

    >>> is_url("s3://line/a.h5"), is_url("zip://a.h5::file:///fleet.zip"), is_url("C:/a.h5")
    (True, True, False)
    """
    return "://" in name


def named_by(url: str, ending: str) -> list[str]:
    """URLs that a URL stands for: itself, what it matches, or what is in the folder. Raises RecordingError."""
    with _opened(url) as (system, path), _told(url, "listed"):
        if any(sign in path for sign in "*?["):
            found = [each for each in system.glob(path) if each.endswith(ending)]
        elif system.isdir(path):
            found = [each for each in system.ls(path, detail=False) if each.endswith(ending)]
        else:
            return [url]
        whole = [system.unstrip_protocol(each) for each in sorted(found)]
    if not found:
        raise RecordingError(f"{url} names no file; expected *{ending} there")
    chained = "".join(url.partition("::")[1:])
    return [each + chained for each in whole]


def stamp_of_url(url: str) -> str:
    """Changes when the file does, by what its file system tells, or empty. Raises RecordingError."""
    with _opened(url) as (system, path), _told(url, "read"):
        known: dict[str, Any] = system.info(path)
    told = {name: str(known[name]) for name in TOLD_BY if known.get(name)}
    return json.dumps({"size": known.get("size"), **told}, sort_keys=True) if told else ""


def sha256_of_url(url: str) -> str:
    """Of its bytes, in hexadecimal. Raises OSError."""
    found = sha256()
    with _opened(url) as (system, path), _as_os_error(url), system.open(path, "rb") as file:
        while piece := file.read(PIECE):
            found.update(piece)
    return found.hexdigest()


@contextmanager
def fetched(url: str) -> Iterator[Path]:
    """The whole file beside us, as long as it is needed. Raises OSError."""
    with _opened(url) as (system, path), TemporaryDirectory(prefix="rig-fleet-") as folder:
        here = Path(folder) / Path(path).name
        with _as_os_error(url):
            system.get_file(path, str(here))
        yield here


@contextmanager
def _told(url: str, what: str) -> Iterator[None]:
    try:
        with _as_os_error(url):
            yield
    except OSError as error:
        raise RecordingError(f"{url} can't be {what}: {error.strerror}") from None


@contextmanager
def _as_os_error(url: str) -> Iterator[None]:
    """File systems of others raise what they like: none of it is about what is in the recording."""
    try:
        yield
    except Exception as error:  # told as one sentence, whatever it is
        raise OSError(EIO, f"{_why(error)} ({url})") from error


@contextmanager
def _opened(url: str) -> Iterator[tuple[Any, str]]:
    """Its file system, and where it is in that. An archive is closed afterwards: nobody else has this one."""
    system, path = _system_of(url)
    try:
        yield system, path
    finally:
        if (archive := getattr(system, "of", None)) is not None:
            archive.close()


def _system_of(url: str) -> tuple[Any, str]:
    if find_spec("fsspec") is None:
        raise ConfigError(
            f"{url}: files by URL are read by fsspec, which is not installed: pip install 'thruster-rig[fleet]'"
        )
    from fsspec.core import url_to_fs

    try:
        found: tuple[Any, str] = url_to_fs(url)
    except (ValueError, ImportError, OSError) as error:
        raise RecordingError(f"{url} can't be read: {_why(error)}") from None
    return found


def _why(error: Exception) -> str:
    return f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
