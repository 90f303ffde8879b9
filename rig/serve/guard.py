"""Who gets in: the one-time token of a link, the cookie it is exchanged for, and what Host and Origin must be. Pure.

A page of any origin can make a browser on this machine send requests to a loopback server, and open websockets with the
browser's cookies. So nothing is believed but the cookie, which is sent to one secret path alone (cookies are shared by
all ports of a host), together with the Origin, which no page can forge.
"""

from __future__ import annotations

import secrets
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

READING: Final = ("GET", "HEAD")
TOKEN_BYTES: Final = 32
NO_LINK: Final = "this page needs the whole link that `rig console --serve` printed, with its token"
USED: Final = "this link has been used or is none of ours; press Enter where `rig console --serve` runs for another one"
NO_COOKIE: Final = "this browser was not let in; open the link that `rig console --serve` printed"


@dataclass(frozen=True, slots=True)
class Asked:
    """Of a request, what decides."""

    method: str
    path: str
    host: str
    """Its Host header."""
    origin: str | None = None
    """Its Origin header; None: it has none."""
    cookie: str = ""
    websocket: bool = False


def _draw() -> str:
    return secrets.token_urlsafe(TOKEN_BYTES)


class Guard:
    """Remembers which links are unused and which browsers were let in."""

    def __init__(self, draw: Callable[[], str] = _draw) -> None:
        """`draw` gives another secret each time."""
        self._draw = draw
        self.room: Final = f"/{draw()}/"
        """The path below which everything is served: secret, no other server on this host is sent the cookie."""
        self._unused: list[str] = []
        self._let_in: list[str] = []

    def new_token(self) -> str:
        """For one more link, good for one browser."""
        self._unused.append(self._draw())
        return self._unused[-1]

    def exchange(self, token: str) -> str | None:
        """The cookie for a token, which is used up by that; None: it is none of ours, or used up."""
        known = _among(token, self._unused)
        if known is None:
            return None
        self._unused.remove(known)
        self._let_in.append(self._draw())
        return self._let_in[-1]

    def refusal(self, asked: Asked, served: frozenset[str]) -> str:
        """Why the request is refused, in a sentence; empty: it is not. `served`: what Host may be."""
        host = asked.host.lower()
        if host not in served:
            return f"the request is for the host {_quoted(asked.host)}; this server is {', '.join(sorted(served))}"
        if asked.origin is None and (asked.websocket or asked.method not in READING):
            return "the request does not say of which page it is (Origin)"
        if asked.origin is not None and asked.origin.lower() != f"http://{host}":
            return f"the request comes from a page of {_quoted(asked.origin)}; only those of http://{host} may ask"
        if asked.method not in READING:
            return f"nothing here is done by {_quoted(asked.method)}"
        if asked.path == "/" and not asked.websocket:
            return ""  # where links are exchanged
        return "" if _among(asked.cookie, self._let_in) is not None else NO_COOKIE


def _among(word: str, known: list[str]) -> str | None:
    """The one of them that is that word; the time it takes tells nothing of them."""
    same = [each for each in known if secrets.compare_digest(each.encode(), word.encode(errors="replace"))]
    return same[0] if same else None


def _quoted(word: str) -> str:
    return repr(word[:80])
