"""Proof that the motor stops by itself when nobody commands it (docs/reliability.md, rule 2). Pure: time is given.

At a low voltage the rig falls silent and measures how long the motor's own watchdog takes. The motor is refused when it
does not slow down, slows down too late, does not come to rest, or moves again afterwards.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

TURNING = 4.0
"""Times the rest rate: from here on the propeller certainly turns."""
SLOWED = 0.8
"""Share of the speed below which the motor has been let go; in water a rotor loses a fifth in tenths of a second."""
SLOWING_TIME = 0.3
"""s after the watchdog's limit for the rotor to lose that fifth and for the status message to arrive."""
SPIN_TIME = (1.3, 2.5)
"""s at the proof voltage: at least, so that rotation and current have settled and are learnt, and at most until the
propeller must turn."""
QUIET_TIME = 0.3
"""s of command 0 after the proof in which the motor must not move."""
PROOFS_OF_A_RUN = 2
"""Before the first step, and at its first rest."""


@dataclass(frozen=True, slots=True)
class ProofSettings:
    """V, V/s, rev/s, s, s: see BenchConfig."""

    voltage: float
    slew: float
    rest_rate: float
    """Or N, where the thrust stands for the rotation rate."""
    watchdog_limit: float
    coast_time: float
    unit: str = "rev/s"
    """Of what `advance` is told: N where no rotation rate is measured."""

    @property
    def slowed(self) -> float:
        """Share below which the motor has been let go; thrust goes with the square of the rate."""
        return SLOWED if self.unit == "rev/s" else SLOWED**2

    @property
    def expected(self) -> float:
        """Expected duration in s: half the silence allowed, and the rest."""
        return self.voltage / self.slew + SPIN_TIME[0] + self.watchdog_limit / 2 + QUIET_TIME + 0.5

    @property
    def worst(self) -> float:
        """Longest duration in s that still passes."""
        turning = self.voltage / self.slew + SPIN_TIME[1]
        return self.coast_time + turning + self.watchdog_limit + self.coast_time + QUIET_TIME


class Proved(NamedTuple):
    """s from the last command to rest."""

    time_to_zero_s: float


class Refused(NamedTuple):
    """Why the watchdog is not proved."""

    cause: str


class ProofStep(NamedTuple):
    """`volts` None: send nothing."""

    volts: float | None
    verdict: Proved | Refused | None = None


ProofPhase = Literal["still", "spin", "silence", "quiet"]


class Proof:
    """One proof, advanced tick by tick until it gives a verdict. Phases: still, spin, silence, quiet."""

    def __init__(self, settings: ProofSettings) -> None:
        self._settings = settings
        self._phase: ProofPhase = "still"
        self._since: float | None = None
        self._last: float = 0.0
        self._volts = 0.0
        self._reached: float | None = None
        self._idle = 0.0
        self._spin = 0.0
        self._slowed = False
        self._time_to_zero = 0.0

    def advance(self, time: float, rotation: float | None) -> ProofStep:
        """What to send at `time` s, given the newest rotation rate in rev/s, or thrust in N (None: unknown)."""
        if self._since is None:
            self._since = self._last = time
        dt, self._last = time - self._last, time
        elapsed = time - self._since
        match self._phase:
            case "still":
                return self._still(time, elapsed, rotation)
            case "spin":
                return self._turn(time, dt, rotation)
            case "silence":
                return self._silence(time, elapsed, rotation)
            case "quiet":
                return self._quiet(elapsed, rotation)

    def _does(self, motion: float) -> str:
        verb = "turns" if self._settings.unit == "rev/s" else "pushes"
        return f"{verb} {motion:.2f} {self._settings.unit}"

    def _go(self, phase: ProofPhase, time: float) -> None:
        self._phase, self._since = phase, time

    def _still(self, time: float, elapsed: float, rotation: float | None) -> ProofStep:
        """At 0 V: note the idle rotation, which flow may keep up."""
        at_rest = rotation is not None and abs(rotation) <= self._settings.rest_rate
        if at_rest or elapsed >= self._settings.coast_time:
            if rotation is None:
                what = "no rotation rate is measured" if self._settings.unit == "rev/s" else "no thrust is measured"
                return ProofStep(0.0, Refused(f"the watchdog can't be proved: {what}"))
            self._idle = 0.0 if at_rest else rotation
            self._go("spin", time)
        return ProofStep(0.0)

    def _turn(self, time: float, dt: float, rotation: float | None) -> ProofStep:
        self._volts = min(self._volts + self._settings.slew * dt, self._settings.voltage)
        if self._volts < self._settings.voltage:
            return ProofStep(self._volts)
        self._reached = time if self._reached is None else self._reached
        held = time - self._reached
        speed = 0.0 if rotation is None else abs(rotation - self._idle)
        if held >= SPIN_TIME[0] and speed >= TURNING * self._settings.rest_rate:
            self._spin = speed
            self._go("silence", time)
        elif held >= SPIN_TIME[1]:
            cause = (
                f"the watchdog can't be proved: the propeller {self._does(speed)} at {self._volts:g} V, at least "
                f"{TURNING * self._settings.rest_rate:g} {self._settings.unit} are needed; raise bench.proof_voltage"
            )
            return ProofStep(0.0, Refused(cause))
        return ProofStep(self._volts)

    def _silence(self, time: float, elapsed: float, rotation: float | None) -> ProofStep:
        """Nothing is sent. `elapsed` counts from the last command."""
        limits = self._settings
        if rotation is not None:
            speed = abs(rotation - self._idle)
            self._slowed = self._slowed or speed < limits.slowed * self._spin
            if speed <= limits.rest_rate:
                self._time_to_zero = elapsed
                self._go("quiet", time)
                return ProofStep(0.0)
        if not self._slowed and elapsed > limits.watchdog_limit + SLOWING_TIME:
            cause = (
                f"the motor's own watchdog is refused: {elapsed:.2f} s without a command and still it turns, "
                f"{limits.watchdog_limit:g} s are allowed; set the device's command timeout"
            )
            return ProofStep(0.0, Refused(cause))
        if elapsed > limits.watchdog_limit + limits.coast_time:
            cause = (
                f"the motor's own watchdog is refused: not at rest {elapsed:.2f} s after the last command, "
                f"{limits.watchdog_limit:g} s and {limits.coast_time:g} s of coasting are allowed"
            )
            return ProofStep(0.0, Refused(cause))
        return ProofStep(None)

    def _quiet(self, elapsed: float, rotation: float | None) -> ProofStep:
        if rotation is not None and abs(rotation - self._idle) >= TURNING * self._settings.rest_rate:
            cause = (
                "the motor moves again at command 0 after its watchdog: the propeller "
                f"{self._does(rotation)}; look at the controller"
            )
            return ProofStep(0.0, Refused(cause))
        return ProofStep(0.0, Proved(self._time_to_zero) if elapsed >= QUIET_TIME else None)
