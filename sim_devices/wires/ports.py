"""Ports the rig opens: ptys in raw mode with stable names, and the control socket. The only module that opens any."""

from __future__ import annotations

import contextlib
import fcntl
import os
import select
import shutil
import socket
import sys
import tempfile
import termios
import tty
from collections.abc import Callable
from math import inf
from pathlib import Path

from sim_devices.tables import WorldError
from sim_devices.wires.serial_line import Wire

READ_SIZE = 4096
HOST_BUFFER = 4000
"""bytes a host may leave unread, as with the kernel's buffer of a real port (4095). More would lie in the pty's own
buffer, survive the flush with which a host opens a port, and be read as new."""
RETRY = 0.005
"""s until a full pty is tried again."""


class PtyPort:
    """One pty, known to the host by a symlink. This side keeps the other end open so that its raw mode lasts."""

    def __init__(self, link: Path, wire: Wire) -> None:
        self.link, self.wire = link, wire
        self._master = self._slave = -1
        self._retry_at = 0.0
        self.device = ""
        self.plug()

    @property
    def plugged(self) -> bool:
        return self._master >= 0

    def fileno(self) -> int:
        return self._master

    def plug(self) -> None:
        """A new pty under the same name."""
        if self.plugged:
            return
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.device = os.ttyname(self._slave)
        self.link.parent.mkdir(parents=True, exist_ok=True)
        self.link.unlink(missing_ok=True)
        self.link.symlink_to(self.device)

    def pull(self) -> None:
        """The cable comes out: reads and writes of the host fail from now on."""
        if not self.plugged:
            return
        self.wire.unplug()
        os.close(self._master)
        os.close(self._slave)
        self._master = self._slave = -1
        if self.link.is_symlink() and str(self.link.readlink()) == self.device:
            self.link.unlink()

    def read(self) -> bytes:
        """Bytes the host has written; empty: none."""
        if not self.plugged:
            return b""
        try:
            return os.read(self._master, READ_SIZE)
        except (BlockingIOError, OSError):
            return b""

    @property
    def due(self) -> float:
        """s: when `flush` has something to do."""
        return max(self.wire.due, self._retry_at) if self.plugged else inf

    def flush(self, t: float) -> None:
        """Hand the host what has arrived by t; what its buffer does not take waits."""
        while self.plugged and (data := self.wire.ready(t)):
            count = self._write(data) if len(data) <= HOST_BUFFER - self._unread() else 0
            self.wire.taken(count)
            if count < len(data):
                self._retry_at = t + RETRY
                return

    def _write(self, data: bytes) -> int:
        try:
            return os.write(self._master, data)
        except BlockingIOError:
            return 0

    def _unread(self) -> int:
        """Bytes the host has not read yet."""
        count = fcntl.ioctl(self._slave, termios.FIONREAD, bytes(4))
        return int.from_bytes(count, sys.byteorder)


class ControlSocket:
    """A Unix socket that takes one command a line and answers one line each. Reached through a symlink.

    The socket itself lies in a short temporary folder: its path may have 107 characters (unix(7)), a link's may not.
    """

    def __init__(self, link: Path) -> None:
        """Raises WorldError when another bench has this folder."""
        link.parent.mkdir(parents=True, exist_ok=True)
        self._lock = _locked(link.parent)
        self.link = link
        self._folder = tempfile.mkdtemp(prefix="sim_bench_")
        self.path = f"{self._folder}/control"
        self._server = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._server.bind(self.path)
        self._server.listen(8)
        self._server.setblocking(False)
        self._clients: dict[socket.socket, bytes] = {}
        link.unlink(missing_ok=True)
        link.symlink_to(self.path)

    def readers(self) -> list[socket.socket]:
        return [self._server, *self._clients]

    def serve(self, handle: Callable[[str], str]) -> None:
        """Take what has come: new clients, and lines, each answered by `handle`. Never blocks."""
        with contextlib.suppress(BlockingIOError):
            client, _ = self._server.accept()
            client.setblocking(False)
            self._clients[client] = b""
        for client in list(self._clients):
            try:
                data = client.recv(READ_SIZE)
            except BlockingIOError:
                continue
            except OSError:
                data = b""
            if not data:
                del self._clients[client]
                client.close()
                continue
            *lines, self._clients[client] = (self._clients[client] + data).split(b"\n")
            with contextlib.suppress(OSError):
                for line in lines:
                    client.sendall(handle(line.decode("utf-8", "replace").strip()).encode() + b"\n")

    def close(self) -> None:
        for each in self.readers():
            each.close()
        if self.link.is_symlink() and str(self.link.readlink()).startswith(self._folder):
            self.link.unlink()
        shutil.rmtree(self._folder, ignore_errors=True)
        os.close(self._lock)


def _locked(folder: Path) -> int:
    """Lock a links folder for as long as this process lives: two benches in one would share links and truth log.

    The lock is on the folder itself, so it leaves no file behind and needs none that somebody may clean away.
    """
    lock = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        os.close(lock)
        raise WorldError(
            f"{folder}: a simulated bench runs here already; stop it, or give this one other --links"
        ) from error
    return lock


def ask(control: Path, line: str, timeout: float = 5.0) -> str:
    """Send one line to a bench's control port and return its answer. Raises OSError when no bench listens."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as client:
        client.settimeout(timeout)
        client.connect(str(control.resolve()))
        client.sendall(line.encode() + b"\n")
        answer = b""
        while not answer.endswith(b"\n"):
            data = client.recv(READ_SIZE)
            if not data:
                raise ConnectionError("the bench closed the control port before it answered")
            answer += data
        return answer.decode().strip()


def wait(ports: list[PtyPort], control: ControlSocket, timeout: float) -> None:
    """Sleep until a host has written something, or `timeout` (s) is over."""
    readers: list[int] = [p.fileno() for p in ports if p.plugged]
    readers += [s.fileno() for s in control.readers()]
    select.select(readers, [], [], timeout)
