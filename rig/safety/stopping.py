"""After a stop: "at 0" means measured at rest, not "we sent 0" (docs/reliability.md, rule 5). Pure: time is given.

A bench without a rotation rate knows less. There the thrust must be back at its tare and the current must drive nothing
for the whole of the time that a propeller may coast: what nobody drives for so long has come to rest (decision 22).
"""

from __future__ import annotations

from typing import NamedTuple

REST_CONFIRM = 0.2
"""s of measured rest before a stop counts as confirmed: ten status messages at 50 Hz."""
EPSILON = 1e-9
"""s, slack for float arithmetic."""


class StopStep(NamedTuple):
    """`confirmed`: True at rest, False not within the coast time, None still waiting."""

    confirmed: bool | None
    release: bool
    """Use the motor's second way to stop as well."""


class Stop:
    """One wait for rest, from command 0 V at `start` s on."""

    def __init__(self, start: float, rest_rate: float, coast_time: float, *, without_rate: bool = False) -> None:
        """`without_rate`: this bench measures no rotation rate and has the two other witnesses."""
        self._start, self._rest_rate, self._coast_time = start, rest_rate, coast_time
        self._without_rate = without_rate
        self._rest_since: float | None = None

    def advance(
        self,
        time: float,
        rotation: float | None,
        thrust_rest: bool | None = None,
        current_rest: bool | None = None,
    ) -> StopStep:
        """`rotation` in rev/s, None: unknown, which is no rest. After half the coast time the motor is released too.

        `thrust_rest`, `current_rest`: what the force sensor and the current say; None: it is no witness.
        """
        if not self._is_rest(rotation, thrust_rest, current_rest):
            self._rest_since = None
        elif self._rest_since is None:
            self._rest_since = time
        elapsed = time - self._start
        rested = self._rest_since is not None and time - self._rest_since >= REST_CONFIRM - EPSILON
        if rested and (not self._without_rate or elapsed >= self._coast_time):
            return StopStep(True, release=False)
        if elapsed >= self._coast_time:
            return StopStep(False, release=True)
        return StopStep(None, release=self._rest_since is None and elapsed >= self._coast_time / 2)

    def _is_rest(self, rotation: float | None, thrust_rest: bool | None, current_rest: bool | None) -> bool:
        if self._without_rate:
            return pushes_nothing(thrust_rest, current_rest)
        return is_rest(rotation, self._rest_rate) and thrust_rest is not False


def is_rest(rotation: float | None, rest_rate: float) -> bool:
    """Whether a rotor turns no faster than `rest_rate` (rev/s); a rate that is not known is no rest."""
    return rotation is not None and abs(rotation) <= rest_rate


def pushes_nothing(thrust_rest: bool | None, current_rest: bool | None) -> bool:
    """Whether thrust and current both say so; one that is no witness says nothing."""
    return thrust_rest is True and current_rest is True


def without_a_rate(thrust_rest: bool | None, current_rest: bool | None) -> str:
    """What is known of the rotation where its rate is not measured, for messages."""
    thrust = {
        True: "the thrust is back at its tare",
        False: "the thrust is not back at its tare",
        None: "the thrust is no witness",
    }
    current = {
        True: "the current drives nothing",
        False: "the current still drives something",
        None: "the current is not known",
    }
    return (
        f"{thrust[thrust_rest]} and {current[current_rest]}; no rotation rate is measured, and a propeller that turns "
        "too slowly to push is not seen"
    )


def turning(rotation: float | None, thrust_rest: bool | None = None) -> str:
    """The rotation in words, and on what it rests, for messages."""
    if rotation is None:
        return "the rotation rate is unknown"
    witness = {
        True: "and the thrust is back at its tare",
        False: "says its rotation rate alone: the thrust is not back at its tare",
        None: "by its rotation rate alone: the thrust is no witness",
    }[thrust_rest]
    return f"the propeller turns {rotation:.2f} rev/s, {witness}"
