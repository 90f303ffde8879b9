"""Which queries a Roboteq controller is asked, how many characters that is, and rows of its answers. Pure."""

from __future__ import annotations

from typing import NamedTuple

PATIENCE = 0.015
"""s, beside twice its time on the line, after which the answers of a round are given up."""
BITS = 10
"""Of a character on the line: 8N1."""
EARLY = 0.25
"""Of a period: a turn that comes by so much too early is one in time."""
COMMANDS = 50.0
"""Set-points/s that the line has to carry as well: the rig's default `loop_rate`."""
COMMAND_CHARACTERS = len("!G 1 -1000\r") + len("+\r")
"""What the controller says to a set-point, with echo."""


class Query(NamedTuple):
    """`name` is how the answer begins, `text` what is asked, `longest` the answer's longest number."""

    name: str
    text: str
    longest: str

    @property
    def characters(self) -> int:
        """What the controller says to it at most, with echo."""
        return len(self.text) + 1 + len(f"{self.name}={self.longest}\r")


def motor_queries(channel: int, rotation: str) -> tuple[Query, ...]:
    """For one row of the motor: rotation where it is measured, motor current, power, supply voltage."""
    speed = {"brushless": "BS", "encoder": "S"}.get(rotation)
    asked = (Query("A", f"?A {channel}", "-1000"), Query("P", f"?P {channel}", "-1000"), Query("V", "?V 2", "1000"))
    return asked if speed is None else (Query(speed, f"?{speed} {channel}", "-65535"), *asked)


def state_queries(channel: int) -> tuple[Query, ...]:
    """For one row of the controller's state. The heat sink of a channel is sensor channel + 1, after the processor."""
    return (
        Query("FF", "?FF", "255"),
        Query("FM", f"?FM {channel}", "255"),
        Query("FS", "?FS", "255"),
        Query("T", f"?T {channel + 1}", "-40"),
        Query("BA", f"?BA {channel}", "-1000"),
        Query("M", f"?M {channel}", "-1000"),
    )


def characters_per_second(channel: int, rotation: str, rate: float, state_rate: float) -> float:
    """What the controller has to say, with echo, while `COMMANDS` set-points a second are sent."""
    rows = sum(query.characters for query in motor_queries(channel, rotation))
    states = sum(query.characters for query in state_queries(channel))
    return rate * rows + state_rate * states + COMMANDS * COMMAND_CHARACTERS


class Round:
    """Queries that are asked together, and the row that their answers make. Answers come in the order of the queries;
    a row that lacks one is none."""

    def __init__(self, queries: tuple[Query, ...], rate: float, baud: int) -> None:
        self._names = tuple(query.name for query in queries)
        self.request = b"".join(query.text.encode("ascii") + b"\r" for query in queries)
        self._period_ns = round(1e9 / rate)
        on_the_line = sum(query.characters for query in queries) * BITS / baud
        self._given_up_ns = round(1e9 * (PATIENCE + 2.0 * on_the_line))
        self._next_ns = self._asked_ns = 0
        self._waiting = False
        self._row: list[tuple[int, ...]] = []

    def begin(self, now_ns: int) -> bool:
        """Whether it is time to send `request`; then it counts as sent."""
        if now_ns < self._next_ns - EARLY * self._period_ns:
            return False
        if self._waiting and now_ns - self._asked_ns < self._given_up_ns:
            return False
        behind = now_ns - self._next_ns >= self._period_ns
        self._next_ns = (now_ns if behind else self._next_ns) + self._period_ns
        self._asked_ns, self._waiting, self._row = now_ns, True, []
        return True

    def take(self, name: str, values: tuple[int, ...]) -> tuple[tuple[int, ...], ...] | None:
        """An answer; the whole row when it was the last one of it."""
        if name == self._names[0]:
            self._row = []
        if name != self._names[len(self._row)]:
            return None
        self._row.append(values)
        if len(self._row) < len(self._names):
            return None
        row, self._row, self._waiting = tuple(self._row), [], False
        return row
