"""Reading what a stranger made in a process of its own: whatever HDF5 does with it, this one goes on.

The child is a fork, so nothing is imported again, and its answer comes back in shared memory. Its time, its memory and
what it may write are limited by the size of the file; once the file is open it can open no other. Decision 14 has what
that costs.
"""

from __future__ import annotations

import faulthandler
import gc
import math
import mmap
import os
import pickle
import resource
import select
import signal
import struct
import sys
import time
import traceback
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from itertools import islice
from pathlib import Path
from typing import Any, Final, NamedTuple, NoReturn, TypeVar

from rig.errors import RecordingError, RigError, UnreadError

T = TypeVar("T")

MEMORY: Final = 256 * 2**20
"""Bytes that reading any file may take,"""
MEMORY_PER_BYTE: Final = 32
"""and for each of its bytes: numbers of four bytes become eight, each has a time of its own, and both are masked."""
SECONDS: Final = 5
"""Of a processor that reading any file may take,"""
BYTES_PER_SECOND: Final = 5 * 2**20
"""and as many again for so many of its bytes: packed ones, on a slow machine."""
PATIENCE: Final = 12
"""By the clock as many times longer: a disk, a network or a busy machine."""
OF_THE_FILE: Final = frozenset(
    {signal.SIGABRT, signal.SIGBUS, signal.SIGFPE, signal.SIGILL, signal.SIGSEGV, signal.SIGXCPU, signal.SIGXFSZ}
)
"""Signals that what is in a file brings upon its reader; of any other somebody else is the cause."""
SIZES: Final = struct.Struct("<Q")
ALIGNED: Final = 64
"""Bytes to whose multiples the arrays begin."""


def apart(work: Callable[[], T], path: Path) -> T:
    """What `work` returns, done in a child that may not use more than the file at `path` justifies.

    Raises what `work` raises, RecordingError where it needed too much or died of what it read, and UnreadError where
    somebody else ended it, the clock did, or there was no process for it. Elsewhere than on Linux, where a
    bench does not run but its recordings are read, it is done here; what is followed and believed is chosen as well.
    """
    found: T = _ended(_begin(work, path.stat().st_size, str(path)))
    return found


def all_apart(
    works: Iterable[tuple[Callable[[], T], Sequence[Path]]], at_once: int | None = None
) -> Iterator[T | RecordingError]:
    """The same for works that each read a little of many files, `at_once` of them at a time (None: one for each
    processor): what each returns, in order. None may use more than the largest of its files justifies.

    In the place of an answer stands the RecordingError of a child that ended without one, which does not know which
    file it was; what a work itself raises is raised.
    """
    most = at_once or len(os.sched_getaffinity(0)) if sys.platform == "linux" else 1
    left, begun = iter(works), deque[_Begun]()
    try:
        while True:
            for work, paths in islice(left, most - len(begun)):
                begun.append(_begin(work, _largest(paths), f"one of {len(paths)} files"))
            if not begun:
                return
            try:
                yield _ended(begun.popleft())
            except RecordingError as error:
                yield error
    finally:
        for child in begun:
            _abandon(child)


def _largest(paths: Sequence[Path]) -> int:
    """Bytes of the largest that is there: one may go meanwhile."""
    sizes = list[int]()
    for path in paths:
        with suppress(OSError):
            sizes.append(path.stat().st_size)
    return max(sizes, default=0)


class _Begun(NamedTuple):
    """A child at work; elsewhere than on Linux the work itself, still to be done."""

    work: Callable[[], Any]
    name: str
    """What it reads."""
    pid: int
    answer: int
    """Descriptor of the memory that it writes its answer to."""
    seconds: int
    memory: int
    until: float
    """s of the monotonic clock."""


def _begin(work: Callable[[], Any], size: int, name: str) -> _Begun:
    if sys.platform != "linux":
        return _Begun(work, name, 0, -1, 0, 0, 0.0)
    seconds = SECONDS + math.ceil(size / BYTES_PER_SECOND)
    memory = MEMORY + MEMORY_PER_BYTE * size
    answer = os.memfd_create("recording", os.MFD_CLOEXEC)
    try:
        pid = os.fork()
    except BaseException as error:
        os.close(answer)
        if isinstance(error, OSError):
            raise UnreadError(f"{name} was not read: no process is to be had for it ({error.strerror})") from None
        raise
    if pid == 0:
        _child(work, answer, seconds, memory)
    return _Begun(work, name, pid, answer, seconds, memory, time.monotonic() + seconds * PATIENCE)


def _ended(child: _Begun) -> Any:
    """What it answered. However this is left, it has ended."""
    if child.pid == 0:
        return child.work()
    try:
        status = _awaited(child.pid, max(child.until - time.monotonic(), 0.0))
        if status != 0:
            raise _error(child, status)
        with suppress(struct.error):  # nothing was written
            return _result(_unpacked(child.answer))
        raise RecordingError(f"{child.name} is damaged: reading it ended without an answer")
    finally:
        os.close(child.answer)


def _abandon(child: _Begun) -> None:
    if child.pid:
        _awaited(child.pid, 0.0)
        os.close(child.answer)


def open_no_more() -> None:
    """From here on the child opens no file: neither one that a link names nor one that holds values."""
    if sys.platform != "linux":
        return
    resource.setrlimit(resource.RLIMIT_NOFILE, (0, resource.getrlimit(resource.RLIMIT_NOFILE)[1]))


def open_again() -> None:
    """A child that has closed its file may open the next one."""
    if sys.platform != "linux":
        return
    hard = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))


def _child(work: Callable[[], object], answer: int, seconds: int, memory: int) -> NoReturn:
    status = 1
    try:
        faulthandler.disable()  # the parent says how this ended
        gc.disable()  # it would touch, and so copy, all that the parent has
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # it is the parent's to stop
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        _limit(resource.RLIMIT_CORE, 0)
        _limit(resource.RLIMIT_CPU, seconds)
        _limit(resource.RLIMIT_AS, memory + _address_space())
        _limit(resource.RLIMIT_FSIZE, memory)
        _write(answer, _attempt(work))
        status = 0
    finally:
        os._exit(status)


def _limit(what: int, most: int) -> None:
    hard = resource.getrlimit(what)[1]
    resource.setrlimit(what, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))


def _address_space() -> int:
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0]) * mmap.PAGESIZE


def _attempt(work: Callable[[], object]) -> tuple[str, object]:
    try:
        return "done", work()
    except RigError as error:
        return "refused", error
    except MemoryError:
        return "memory", None
    except Exception:  # noqa: BLE001 - the top of a process; a fault of this program, which the parent raises
        return "failed", traceback.format_exc()


def _result(found: tuple[str, Any]) -> Any:
    how, what = found
    if how == "done":
        return what
    if how == "refused" and isinstance(what, RigError):
        raise what
    if how == "memory":
        raise RecordingError(
            "more memory is needed to read the recording than its size justifies; unpack it: h5repack -f NONE IN OUT"
        )
    raise RuntimeError(f"reading a recording failed:\n{what}")


def _write(answer: int, result: tuple[str, object]) -> None:
    """Number of arrays, the pickle and the arrays, each behind its length."""
    arrays: list[pickle.PickleBuffer] = []
    pickled = pickle.dumps(result, protocol=5, buffer_callback=arrays.append)
    pieces = [memoryview(pickled), *(array.raw() for array in arrays)]
    with open(answer, "wb", closefd=False) as file:
        file.write(SIZES.pack(len(arrays)))
        for piece in pieces:
            file.write(SIZES.pack(piece.nbytes))
            file.seek(-file.tell() % ALIGNED, os.SEEK_CUR)
            file.write(piece.cast("B"))
        file.truncate()


def _unpacked(answer: int) -> tuple[str, Any]:
    """Arrays that can't be written, all in one piece of memory. Raises struct.error if nothing was answered."""
    with open(answer, "rb", closefd=False) as file:
        file.seek(0)
        view = memoryview(file.read())
    (count,) = SIZES.unpack_from(view)
    at, pieces = SIZES.size, []
    for _ in range(count + 1):
        (length,) = SIZES.unpack_from(view, at)
        at += SIZES.size
        at += -at % ALIGNED
        pieces.append(view[at : at + length])
        at += length
    found: tuple[str, Any] = pickle.loads(pieces[0], buffers=pieces[1:])  # noqa: S301 - of our own child
    return found


def _awaited(child: int, seconds: float) -> int | None:
    """Exit status, negative for a signal; None where these seconds were over first. However this is left, the child has
    ended."""
    descriptor = os.pidfd_open(child)
    try:
        poll = select.poll()
        poll.register(descriptor, select.POLLIN)
        ended = poll.poll(seconds * 1000)
    finally:
        os.close(descriptor)
        with suppress(ProcessLookupError):
            os.kill(child, signal.SIGKILL)  # one that has ended is not hurt: it waits to be asked how
        _, status = os.waitpid(child, 0)
    return os.waitstatus_to_exitcode(status) if ended else None


def _error(child: _Begun, status: int | None) -> RecordingError:
    if status is None:
        within = child.seconds * PATIENCE
        return UnreadError(f"{child.name} was not read within {within} s: its disk or this machine is slow; ask again")
    if status < 0 and -status not in OF_THE_FILE:
        by = signal.Signals(-status).name
        why = "the system does so when memory runs out; " if by == "SIGKILL" else ""
        return UnreadError(f"{child.name} was not read: its process was ended from outside ({by}; {why}ask again)")
    return RecordingError(f"{child.name} is damaged, or was made to harm: {_reason(status, child)}")


def _reason(status: int, child: _Begun) -> str:
    if status == -signal.SIGXCPU:
        return f"reading it takes more than {child.seconds} s of a processor"
    if status == -signal.SIGXFSZ:
        return f"what it says it holds takes more than {child.memory // 2**20} MiB, which its size does not justify"
    return f"HDF5 ended with {signal.Signals(-status).name if status < 0 else f'status {status}'}"
