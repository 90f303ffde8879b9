"""What goes into and comes out of the sequencer in one tick of the control loop."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

from identification.recording import Step as StepRow
from identification.steady_state.steady import SteadyMonitor
from rig.campaign.config import BenchConfig, CampaignConfig
from rig.campaign.dwell import SteadyDwell
from rig.campaign.plan import Phase, TareConfig
from rig.link.front_end_messages import LogLine, Point, Request, State
from rig.safety.guard import MIN_LATENESS, Trip
from rig.safety.watchdog_proof import ProofSettings
from rig.sequence.steady import SteadyEstimator

Outcome = Literal["running", "completed", "aborted", "tripped"]
EPSILON = 1e-9
"""s and V, slack for float arithmetic."""


@dataclass(frozen=True, slots=True)
class Settings:
    """All that the sequencer must know of bench and campaign."""

    thruster: str
    max_voltage: float
    """V; a step beyond it is refused at construction."""
    slew: float
    """V/s of every ramp that is no measurement."""
    rest_rate: float
    """rev/s"""
    coast_time: float
    """s"""
    tare: TareConfig
    lapse: float
    """s between two ticks from which on the command is 0 and the run ends."""
    max_std_error: float | None = None
    """N, of a hold until steady; None: the dwell is fixed."""
    max_drift: float | None = None
    """N/s"""
    proof: ProofSettings | None = None
    """None: the watchdog is not proved in this run."""
    proved: bool = False
    """It was in an earlier run of this motor: it is proved again at the first rest alone."""
    without_rate: bool = False
    """No rotation rate is measured: thrust and current stand for it."""
    attended: bool = True
    """Somebody can be asked."""
    estimator: Callable[[], SteadyEstimator] = SteadyMonitor
    """Makes an empty estimator."""

    def proofs_before(self, phases: Iterable[Phase]) -> tuple[str, ...]:
        """Before what the watchdog is proved in a run of steps of these `phases`: its start, then its first rest, if it
        has one: it may break meanwhile. A proof by the thrust comes after the first tare."""
        if self.proof is None:
            return ()
        steps = tuple(phases)
        start = next((phase for phase in steps if phase != "tare"), "start") if self.without_rate else "start"
        return (start,) * (not self.proved) + ("rest",) * ("rest" in steps and (self.proved or start != "rest"))


@dataclass(frozen=True, slots=True)
class Tick:
    """One look at the bench. Times in s since the start of the run, never running backwards."""

    time: float
    thrust: tuple[tuple[float, float], ...] = ()
    """(s, N) rows since the last tick, raw (no tare subtracted)."""
    rotation: float | None = None
    """rev/s, newest; None: none, or none that is fresh."""
    thrust_rest: bool | None = None
    """Whether the force sensor says that nothing pushes; None: it is no witness."""
    push: float | None = None
    """N from the tare; None: not known."""
    current_rest: bool | None = None
    """Whether the current drives nothing; None: it is not known, or the rotation rate is measured."""
    temperature: float | None = None
    """degC of the channel that a cool-down waits for; None: none, or none that is fresh."""
    trip: Trip | None = None
    requests: tuple[Request, ...] = ()
    """Those of `rig.sequence.requests` are obeyed, others are ignored."""


class Output(NamedTuple):
    """What to do now, and what is finished. One a tick, hence a tuple: quicker to make than a frozen dataclass."""

    volts: float | None
    """Command to send; None: send nothing (the watchdog is being proved)."""
    state: State
    step: int
    """Index of the running step."""
    steps: int
    step_elapsed: float
    step_expected: float
    remaining: float
    """s to the end of the run, by plan."""
    reason: str = ""
    """Of a wait or a pause: what for."""
    state_elapsed: float = 0.0
    """s in this wait or pause."""
    paused_for: float = 0.0
    """s in pauses since the run began."""
    release: bool = False
    """True: the motor still turns after a stop, use MotorController.release() as well."""
    points: tuple[Point, ...] = ()
    """Holds that were finished in this tick."""
    rows: tuple[StepRow, ...] = ()
    """Steps that were finished in this tick, as really run, for `/steps`."""
    events: tuple[LogLine, ...] = ()
    given_up: tuple[int, ...] = ()
    """Indices of steps that an operator left out or marked bad in this tick: a run is whole without them."""
    tare: float | None = None
    """N, latest accepted tare; None before the first."""
    time_to_zero_s: float | None = None
    """s, result of the watchdog proof."""
    outcome: Outcome = "running"
    """Leaves `running` when the stop begins; `done` says when it is over."""
    cause: str = ""
    stop_confirmed: bool | None = None
    """Measured: True at rest, False STOP NOT CONFIRMED, None not known yet."""
    done: bool = False


def settings_for(campaign: CampaignConfig, thruster: str) -> Settings:
    """Settings of one thruster's run."""
    bench, plan = campaign.bench, campaign.plan
    steady = plan.dwell if isinstance(plan.dwell, SteadyDwell) else None
    slew = min(plan.slew, bench.slew)
    return Settings(
        thruster=thruster,
        max_voltage=bench.max_voltage,
        slew=slew,
        rest_rate=bench.rest_rate,
        coast_time=bench.coast_time,
        tare=campaign.tare,
        lapse=max(5 / bench.loop_rate, MIN_LATENESS) + 1 / bench.loop_rate,
        max_std_error=steady.max_std_error if steady else None,
        max_drift=steady.max_drift if steady else None,
        proof=proof_settings(bench, slew) if campaign.prove_watchdog else None,
        attended=not campaign.unattended,
    )


def by_thrust(settings: Settings, rest_thrust: float) -> Settings:
    """The same for a bench without a rotation rate: the watchdog is proved by the thrust, `rest_thrust` N at rest."""
    proof = settings.proof
    return replace(
        settings, without_rate=True, proof=None if proof is None else replace(proof, rest_rate=rest_thrust, unit="N")
    )


def proof_settings(bench: BenchConfig, slew: float) -> ProofSettings:
    """What a proof of the watchdog is run with: the numbers of the bench, and the slew of the campaign in V/s."""
    return ProofSettings(bench.proof_voltage, slew, bench.rest_rate, bench.watchdog_limit, bench.coast_time)
