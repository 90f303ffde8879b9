"""A file that a person edits: read once, written in one piece, and not over what somebody else has written since."""

from __future__ import annotations

import contextlib
import os
import tempfile
from dataclasses import dataclass
from pathlib import Path

from rig.errors import ConfigError
from rig.regular_file import read
from rig.toml_tables import MOST_BYTES


class ChangedOnDiskError(ConfigError):
    """The file is no longer what was read: another program has written it, or taken it away."""


@dataclass(frozen=True, slots=True)
class Opened:
    """A file as it was last read or written here."""

    path: Path
    content: bytes

    @property
    def text(self) -> str:
        """Line ends as they are in the file."""
        return self.content.decode("utf-8")


def opened(path: Path) -> Opened:
    """Read a campaign file. Raises ConfigError."""
    try:
        content = read(path, "campaign file", MOST_BYTES, ConfigError)
        content.decode("utf-8")
    except FileNotFoundError:
        raise ConfigError(f"{path}: there is no such campaign file; give the path of one, or make one: rig init") from (
            None
        )
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path}: this campaign file can't be read: {error}") from None
    return Opened(path, content)


def saved(before: Opened, text: str, *, anyway: bool = False) -> Opened:
    """Write `text` in the place of what was read: after a crash the file is the old one or the new one, whole.

    Raises ChangedOnDiskError when the file is not what was read, unless it is to be written `anyway`; ConfigError when
    it can't be written.
    """
    content = text.encode("utf-8")
    if not anyway and not _same(before):
        raise ChangedOnDiskError(f"{before.path}: another program has changed this file since it was read")
    try:
        _replace(before.path.resolve(), content)
    except OSError as error:
        raise ConfigError(f"{before.path}: this file can't be written: {error.strerror}; nothing is saved") from None
    return Opened(before.path, content)


def _same(before: Opened) -> bool:
    try:
        return opened(before.path).content == before.content
    except ConfigError:
        return False


def _replace(path: Path, content: bytes) -> None:
    """Beside it, onto the disk, then into its name. A link stays one; the file keeps its permissions."""
    descriptor, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    part = Path(name)
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(content)
            file.flush()
            os.fchmod(file.fileno(), _mode(path))
            os.fsync(file.fileno())
        part.replace(path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise
    _sync_folder(path.parent)


def _mode(path: Path) -> int:
    try:
        return path.stat().st_mode & 0o777
    except FileNotFoundError:
        return 0o644


def _sync_folder(folder: Path) -> None:
    """The new name onto the disk too. Some file systems cannot, and then the name is theirs to keep."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        with contextlib.suppress(OSError):
            os.fsync(descriptor)
    finally:
        os.close(descriptor)
