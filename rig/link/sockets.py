"""Local sockets between the processes: framed messages, never blocking; end of file = the other side is gone."""

from __future__ import annotations

import contextlib
import errno
import hashlib
import os
import socket
import tempfile
from pathlib import Path
from typing import Final

from rig.errors import LinkError
from rig.link.framing import HEADER, KINDS, MAX_FRAME, Message, decode, encode

BOUND: Final = 64 * 2**20
"""Bytes that wait for a slow reader before `Overrun`: a minute of five streams at 1 kHz."""
MAX_PATH: Final = 107
"""Longest AF_UNIX path in bytes: sun_path of 108 with its end mark, unix(7)."""
READ_AT_ONCE: Final = 16 * 2**20
"""Bytes taken by one `receive`, so that a fast writer cannot hold the caller's loop."""
AT_ONE_CALL: Final = 2**16
"""Bytes asked of the kernel at once: room for twice as many is mapped anew each time, also when nothing has come."""


class Overrun(LinkError):
    """The other side reads slower than we write: nothing was dropped, and nothing more fits."""


class Peer:
    """The other end of a connected socket. Selectable; owns the socket."""

    def __init__(
        self,
        connection: socket.socket,
        name: str,
        bound: int = BOUND,
        longest: int = MAX_FRAME,
        at_once: int = READ_AT_ONCE,
    ) -> None:
        """`name` is what messages call the other side. Limits in bytes: `bound` of what waits to be sent, `longest` of
        a message that comes, `at_once` of what one `receive` takes."""
        connection.setblocking(False)
        self.name = name
        self.closed = False
        """True once `receive` met the end of file: the other side is gone, and all that it sent has been delivered."""
        self._deaf = False
        self._socket = connection
        self._bound, self._longest, self._at_once = bound, longest, at_once
        self._outgoing = bytearray()
        self._incoming = bytearray()

    def fileno(self) -> int:
        return self._socket.fileno()

    @property
    def waiting(self) -> int:
        """Bytes not yet taken by the kernel: select for writing while there are any, then `flush`."""
        return len(self._outgoing)

    @property
    def unfinished(self) -> int:
        """Bytes of a frame that has begun to arrive: lost when `closed`."""
        return len(self._incoming)

    def send(self, message: Message) -> None:
        """Append one message and send what goes without blocking. Raises Overrun. To a side that is gone nothing is
        sent, and nothing is said: the next `receive` finds the end of file after what is still to be read."""
        if self.closed or self._deaf:
            return
        frame = encode(message)
        if len(self._outgoing) + len(frame) > self._bound:
            self.flush()
        if len(self._outgoing) + len(frame) > self._bound:
            raise Overrun(
                f"{self.name} does not read: {len(self._outgoing)} bytes wait and the bound is {self._bound}; "
                "its disk or its terminal is stuck"
            )
        self._outgoing += frame
        self.flush()

    def flush(self) -> None:
        """Send what the kernel takes now."""
        while self._outgoing and not self._deaf:
            try:
                with memoryview(self._outgoing) as view:
                    sent = self._socket.send(view[: 2**20])
            except BlockingIOError:
                return
            except (BrokenPipeError, ConnectionResetError):
                self._deaf = True
                self._outgoing.clear()
                return
            del self._outgoing[:sent]

    def receive(self) -> list[Message]:
        """Messages that are there now, in order; sets `closed` at end of file. Raises LinkError for anything else."""
        self._fill()
        messages = []
        start = 0
        while len(self._incoming) - start >= HEADER.size:
            length, kind = HEADER.unpack_from(self._incoming, start)
            if length > self._longest or kind not in KINDS:
                raise LinkError(
                    f"{self.name} sent a frame header of kind {kind}, {length} bytes: "
                    f"not a rig process, out of step, or longer than {self._longest} bytes; close the link"
                )
            end = start + HEADER.size + length
            if len(self._incoming) < end:
                break
            messages.append(decode(kind, bytes(self._incoming[start + HEADER.size : end])))
            start = end
        del self._incoming[:start]
        return messages

    def _fill(self) -> None:
        taken = 0
        while not self.closed and taken < self._at_once:
            try:
                data = self._socket.recv(min(AT_ONE_CALL, self._at_once))
            except BlockingIOError:
                return
            except ConnectionResetError:
                data = b""
            self.closed = not data
            self._incoming += data
            taken += len(data)

    def close(self) -> None:
        """Let the socket go; safe to call twice."""
        self.closed = self._deaf = True
        self._socket.close()


def socket_path(directory: Path, name: str, fallback: Path | None = None) -> Path:
    """Where the socket `name` of that directory lives: there, or, when that path is too long for AF_UNIX, in a private
    directory (0700; `fallback`, by default under the temporary directory), by a name derived from the long path."""
    wanted = directory.resolve() / name
    if len(os.fsencode(wanted)) <= MAX_PATH:
        return wanted
    short = fallback or Path(tempfile.gettempdir()) / f"thruster-rig-{os.getuid()}"
    short.mkdir(mode=0o700, exist_ok=True)
    status = short.lstat()
    if status.st_uid != os.getuid() or status.st_mode & 0o077 or short.is_symlink():
        raise LinkError(
            f"{short} must be a directory of yours with mode 0700: another user may have made it; remove it"
        )
    digest = hashlib.sha256(os.fsencode(wanted)).hexdigest()[:16]
    return short / f"{digest}.sock"


def listen(path: Path) -> socket.socket:
    """A listening socket, mode 0600, non-blocking. One left by a dead process is replaced, a live one refused."""
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        if path.exists():
            _remove_dead(path)
        listener.bind(str(path))
        path.chmod(0o600)
        listener.listen(16)
    except OSError as error:
        listener.close()
        raise LinkError(f"cannot listen on {path}: {error.strerror or error}") from error
    except LinkError:
        listener.close()
        raise
    listener.setblocking(False)
    return listener


def _remove_dead(path: Path) -> None:
    if not path.is_socket():
        raise LinkError(f"{path} exists and is not a socket; move it away")
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        probe.settimeout(1.0)
        try:
            probe.connect(str(path))
        except ConnectionRefusedError:
            path.unlink()
            return
        except TimeoutError:
            pass  # somebody listens and is slow: alive
    raise LinkError(f"another process already listens on {path}; stop it, or use its console")


NOT_NOW: Final = (
    errno.EAGAIN, errno.EWOULDBLOCK, errno.ECONNABORTED, errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM,
)  # fmt: skip
"""Nobody waits, or this process has no room for one more: accept(2). Neither ends a run."""


def accept(
    listener: socket.socket, name: str, bound: int = BOUND, longest: int = MAX_FRAME, at_once: int = READ_AT_ONCE
) -> Peer | None:
    """The next waiting front end, or None; the limits are those of `Peer`."""
    try:
        connection, _ = listener.accept()
    except OSError as error:
        if error.errno in NOT_NOW:
            return None
        raise
    return Peer(connection, name, bound, longest, at_once)


def connect(path: Path, name: str, timeout: float = 2.0) -> Peer:
    """Connect to a listening process. Raises LinkError when there is none."""
    connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    connection.settimeout(timeout)
    try:
        connection.connect(str(path))
    except OSError as error:
        connection.close()
        reason = error.strerror or str(error)
        raise LinkError(f"{name} does not answer on {path}: {reason}; is a run going on in that folder?") from error
    return Peer(connection, name)


def pair(name: str, bound: int = BOUND) -> tuple[Peer, socket.socket]:
    """Our end as a Peer and the other end as a socket to hand to a child process."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_STREAM)
    return Peer(ours, name, bound), theirs


def remove(path: Path) -> None:
    """Take the name of a listening socket away; gone already is fine."""
    with contextlib.suppress(FileNotFoundError):
        path.unlink()
