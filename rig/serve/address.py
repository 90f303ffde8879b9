"""Where the server listens, under which names it may be asked for, and what an address open to others means."""

from __future__ import annotations

import errno
import ipaddress
import socket
from typing import Final

from rig.errors import RigError

LOOPBACK: Final = "127.0.0.1"
OPEN: Final = (
    "--host {host}: others on that network reach this server too. Its link keeps out who does not have it; it does not "
    "keep anybody on the way from reading along, the link included, and pressing keys with what was read: the traffic "
    "is not encrypted. On a network that is not yours alone take `ssh -L {port}:127.0.0.1:{port}` and leave --host out"
)


def listen(host: str, port: int) -> socket.socket:
    """A listening socket; `port` 0 is any that is free. Raises RigError."""
    address = address_of(host)
    family = socket.AF_INET6 if ":" in address else socket.AF_INET
    try:
        return socket.create_server((address, port), family=family)
    except OSError as error:
        raise RigError(_why_not(error, host, port)) from error


def _why_not(error: OSError, host: str, port: int) -> str:
    match error.errno:
        case errno.EADDRINUSE:
            return f"--port {port}: another program listens there already; take another number, or 0 for any free one"
        case errno.EADDRNOTAVAIL | errno.EAFNOSUPPORT:
            return f"--host {host}: this machine does not have that address; `ip address` lists those that it has"
        case _:
            return f"--host {host}, --port {port}: can't be listened at: {error.strerror or error}"


def address_of(host: str) -> str:
    """The IP address of a `--host`. Raises RigError.

    >>> address_of("localhost"), address_of("::1")
    ('127.0.0.1', '::1')
    """
    try:
        return str(ipaddress.ip_address(LOOPBACK if host == "localhost" else host))
    except ValueError:
        raise RigError(
            f"--host {host}: an IP address of this machine was expected, such as {LOOPBACK} (the default: nobody else "
            "reaches it) or 0.0.0.0 (all that this machine has)"
        ) from None


def is_loopback(address: str) -> bool:
    """Whether this machine alone reaches it."""
    return ipaddress.ip_address(address).is_loopback


def warning(host: str, address: str, port: int) -> str:
    """What it means that `host`, an `address`, is listened at; empty: this machine alone reaches it.

    >>> warning("localhost", "127.0.0.1", 8000), "not encrypted" in warning("0.0.0.0", "0.0.0.0", 8000)
    ('', True)
    """
    return "" if is_loopback(address) else OPEN.format(host=host, port=port)


def served_hosts(address: str, port: int, name: str) -> frozenset[str]:
    """What the Host of a request may be that arrived at `address`, on a machine called `name`. A page whose own name
    was made to lead here (DNS rebinding) has another one.

    >>> sorted(served_hosts("127.0.0.1", 8000, "bench"))
    ['127.0.0.1:8000', 'localhost:8000']
    >>> sorted(served_hosts("10.0.0.7", 8000, "Bench"))
    ['10.0.0.7:8000', 'bench:8000']
    """
    names = {written(address), "localhost" if is_loopback(address) else name.lower()}
    return frozenset(f"{each}:{port}" for each in names)


def written(address: str) -> str:
    """As it stands in a link."""
    return f"[{address}]" if ":" in address else address


def link(address: str, port: int, name: str, token: str) -> str:
    """To be opened in a browser, once."""
    unspecified = ipaddress.ip_address(address).is_unspecified
    return f"http://{name.lower() if unspecified else written(address)}:{port}/?token={token}"
