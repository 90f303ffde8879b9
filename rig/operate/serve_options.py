"""`--serve`, `--host` and `--port` of `rig console`."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Final, NamedTuple, TypeVar

import click

from rig.errors import RigError

C = TypeVar("C", bound=Callable[..., int])
HOST: Final = "127.0.0.1"
PORT: Final = 8000


class Address(NamedTuple):
    """Where the console is served."""

    host: str = HOST
    port: int = PORT
    """0: any that is free."""


def serve_options(command: C) -> C:
    """The three options, as one parameter `at`; None: not in a browser."""

    @click.option("--serve", is_flag=True, help="Show it in a browser instead: prints a link that is good for one.")
    @click.option(
        "--host", help=f"With --serve: the address to listen at (default: {HOST}, which only this machine reaches)."
    )
    @click.option(
        "--port", type=click.IntRange(0, 65535), help=f"With --serve: the port (default: {PORT}; 0: any free one)."
    )
    @wraps(command)
    def with_address(*, serve: bool, host: str | None, port: int | None, **others: object) -> int:
        if not serve and (host is not None or port is not None):
            raise RigError(f"{'--port' if host is None else '--host'} is where --serve listens: give --serve too")
        at = Address(HOST if host is None else host, PORT if port is None else port)
        return command(at=at if serve else None, **others)

    return with_address  # type: ignore[return-value]  # the same command with three parameters in the place of one
