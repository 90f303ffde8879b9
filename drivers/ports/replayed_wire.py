"""A wire whose far end says again what a transcript has, at its times: replies after the questions they answer."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from itertools import islice

from drivers.ports.can_frame import Frame, frame_of
from drivers.ports.transcript import Chunk
from drivers.ports.wire import Arrived

BEFORE = 0.1
"""s before the first chunk at which the time of the wire begins: a driver that only listens waits from there on."""
LEFT_OUT = 0.5
"""s after which a question of the transcript that the driver has not put is passed over."""
SAME_AMONG = 4
"""Questions of the transcript among which one is looked for: a driver of two rounds does not keep their order."""
DIFFERENCES = 5
"""Kept word for word."""


class ReplayedWire:
    """What the driver writes takes the next question of the transcript away, and what follows that may come then."""

    def __init__(self, chunks: Iterable[Chunk], questions: Callable[[bytes], bool] = bool) -> None:
        """`questions`: which of what the driver writes are in the transcript. Raises ValueError for no chunk at all."""
        self._questions = questions
        in_time = sorted(chunks, key=lambda chunk: chunk.t_ns)  # an answer may be written before its question
        self._chunks = deque(in_time)
        if not self._chunks:
            raise ValueError("a transcript without a single chunk cannot be replayed")
        self._t = self._chunks[0].t_ns * 1e-9 - BEFORE
        self._arrived: Arrived | None = None
        self.differences: list[str] = []
        """Where the driver asked otherwise than in the transcript."""

    @property
    def over(self) -> bool:
        """Nothing more comes."""
        return not any(chunk.direction == "<" for chunk in self._chunks)

    def now(self) -> float:
        return self._t

    def wait(self, seconds: float) -> None:
        """Let the next chunk come, if it is due in `seconds`; else only time passes."""
        end = self._t + seconds
        if self._chunks and self._chunks[0].direction == "<" and self._chunks[0].t_ns * 1e-9 <= end:
            chunk = self._chunks.popleft()
            self._t = max(self._t, chunk.t_ns * 1e-9)
            if self._arrived is not None:
                self._arrived(chunk.t_ns, chunk.data)
        else:
            self._t = end
            self._leave_out()

    def connect(self, arrived: Arrived) -> None:
        self._arrived = arrived

    def write(self, data: bytes) -> None:
        """The transcript's next question is this one, and it is asked when it was; one that differs is noted."""
        if not self._questions(data):
            return
        next_ones = list(islice((n for n, chunk in enumerate(self._chunks) if chunk.direction == ">"), SAME_AMONG))
        if not next_ones:
            return
        place = next((n for n in next_ones if self._chunks[n].data == data), next_ones[0])
        question = self._chunks[place]
        del self._chunks[place]
        self._t = max(self._t, question.t_ns * 1e-9)
        if question.data != data and not self.over and len(self.differences) < DIFFERENCES:
            self.differences.append(
                f"at {question.t_ns} ns the driver asked {data.hex(' ')}, the transcript has {question.data.hex(' ')}"
            )

    def disconnect(self) -> None:
        self._arrived = None

    def _leave_out(self) -> None:
        """Questions that the driver does not put, when their time has long come: what follows them is not held back."""
        while self._chunks and self._chunks[0].direction == ">" and self._t > self._chunks[0].t_ns * 1e-9 + LEFT_OUT:
            self._chunks.popleft()


def as_slcan(chunks: Iterable[Chunk]) -> list[Chunk]:
    """Frames of a bus's transcript as an slcan adapter says them. Raises ValueError for what is no frame."""
    return [chunk._replace(data=slcan_line(frame_of(chunk.data))) for chunk in chunks]


def slcan_line(frame: Frame) -> bytes:
    """LAWICEL CANUSB manual 1.0D, 3: `tIIILDD` or `TIIIIIIIILDD`, CR."""
    head = f"T{frame.id:08X}" if frame.extended else f"t{frame.id:03X}"
    return f"{head}{len(frame.data)}{frame.data.hex().upper()}\r".encode("ascii")


def is_frame(data: bytes) -> bool:
    """Whether what is written to an slcan adapter is a frame, and no command to the adapter itself."""
    return data[:1] in (b"t", b"T")
