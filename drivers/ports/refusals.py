"""Why a port does not open, as one sentence that says what to do."""

from __future__ import annotations

import errno

NONE = (errno.ENOENT, errno.ENODEV, errno.ENXIO)
BUSY = (errno.EBUSY, errno.EAGAIN)
DENIED = (errno.EACCES, errno.EPERM)
NO_TERMINAL = (errno.ENOTTY, errno.EINVAL)


def why_not_open(error: Exception) -> str:
    """The reason of an error at the opening of a port, and what to do."""
    number = _number(error)
    if number in NONE:
        return "there is no such port: connect it or correct the path (`rig devices` lists those of this machine)"
    if number in DENIED:
        return "this user may not open it: join the port's group (often `sudo usermod -aG dialout $USER`), log in again"
    if number in BUSY:
        return "another program has it open: end that first (a run: `rig stop`; a terminal program; VESC Tool)"
    if number in NO_TERMINAL:
        return f"it is no serial port, or cannot do what it is asked for ({error}): check path, baud and framing"
    return f"{error}. Check cable, path and power"


def _number(error: BaseException | None) -> int | None:
    """The errno of an error or of what it was raised from; libraries wrap them, some without passing it on."""
    while error is not None:
        number = getattr(error, "errno", None)
        if isinstance(number, int):
            return number
        first = error.args[0] if error.args else None
        if isinstance(first, int):
            return first
        error = error.__cause__ or error.__context__
    return None
