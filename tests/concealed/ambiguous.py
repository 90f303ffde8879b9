"""Recordings that cannot tell one effect from another, and the same bench once more, in virtual time, for the sweep."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby

import numpy as np

from identification.mismatch.diagnosis import Diagnosis, NextExperiment, PlanStep
from identification.mismatch.next_experiment.sequential_experiment import Course, End, allowance, belief, next_step
from identification.mismatch.next_experiment.sweeps import Limits
from identification.mismatch.pipeline import diagnose
from identification.recording import Recording
from sim_devices import concealed
from sim_devices.concealed.cases.definition import Case, Run
from sim_devices.concealed.cases.plans import Profile, Step
from tests.concealed.recordings import recordings

STATIC = ("dead_band", "exponent", "linear_term", "winding_resistance", "cavitation", "load_cell_nonlinearity")
SLOW = ("heating", "zero_drift", "load_cell_creep", "recirculation", "supply_sag")
EFFECTS = {
    "staircase": (*STATIC, *SLOW, "command_saturation", "load_cell_saturation"),
    "flow": (*STATIC, "speed_of_advance", "strut_drag", "recirculation"),
    "no_rest": (*STATIC, *SLOW, "hysteresis"),
}
"""Design -> effects that it shows, and shows badly. Asymmetry and torque cross-talk are the same on thrust alone, in
every design: they are rivals here, but no sweep would ever settle them."""
RIVALS = ("asymmetry", "torque_crosstalk")
ALIKE = 2.0
"""Sigma: what another effect would leave of this one when the recording cannot tell them."""
TRIES = 200
CHANNELS = ("rotation_rate", "current", "bus_voltage", "motor_temperature")
TICK = 0.02
"""s between two commands of the loop."""
TARE = 3.0
"""s before and after a sweep."""
OPENING = 15.0
"""s that a run takes beside its recording: ports, preflight, watchdog proof, closing."""
PAUSE = 60.0
"""s of world time between two recordings."""
SEED = 5


@dataclass(frozen=True)
class Ambiguous:
    """A bench with one concealed effect, and the recording made so far."""

    design: str
    effect: str
    case: Case
    slew: float
    """V/s"""
    twins: tuple[str, ...] = ()
    """Effects that would leave less than ALIKE sigma of it in the recording."""


def drawn(number: int, design: str = "", effect: str = "") -> Ambiguous:
    """The bench of that number: design, effect, strength, scales, noise and channels are drawn unless they are given.

    Drawn anew until another effect explains the recording as well: not as the diagnosis has it, but as an oracle does.
    """
    rng = np.random.default_rng([SEED, number])
    kind = design or list(EFFECTS)[number % len(EFFECTS)]
    for _ in range(TRIES):
        chosen = effect or str(rng.choice(EFFECTS[kind]))
        try:
            found = _drawn(rng, kind, chosen, float(np.exp(rng.uniform(np.log(12.0), np.log(40.0)))))
        except concealed.OutOfReach:
            continue
        alike = concealed.twins(found.case, chosen, (*EFFECTS[kind], *RIVALS), rng)
        if alike[0].left < ALIKE:
            return replace(found, twins=tuple(twin.rival for twin in alike if twin.left < ALIKE))
    raise concealed.OutOfReach(f"{effect or 'nothing'} is ambiguous in a design {kind}")


def _drawn(rng: np.random.Generator, design: str, effect: str, strength: float) -> Ambiguous:
    channels = [name for name in CHANNELS if rng.random() < 0.3]
    channels += ["flow_speed"] if design == "flow" else []
    sampling, noise = float(rng.choice((20.0, 50.0, 92.0))), str(rng.choice(("white", "mixed")))
    case = concealed.case(rng, [effect], strength, noise=noise, sampling=sampling, duration=240.0, channels=channels)
    top = case.scale.voltage
    steps, slew = _steps(design, top, rng), top / float(rng.uniform(0.5, 1.5))
    profile = _profile(steps, slew, case.dt, tare=design != "no_rest")
    flow = _following(profile, case.scale.flow, top) if design == "flow" else ((0.0, 0.0),)
    run = replace(case.runs[0], profile=profile, flow=flow)
    return Ambiguous(design, effect, concealed.scaled_to(replace(case, runs=(run,)), effect, strength), slew)


def _steps(design: str, top: float, rng: np.random.Generator) -> list[tuple[float, float]]:
    """(V, s) of the holds."""
    dwell = float(rng.uniform(5.0, 12.0))
    if design == "staircase":
        levels = int(rng.integers(4, 10))
        return [(round(top * k / levels, 2), dwell) for k in range(1, levels + 1)]
    levels = int(rng.integers(3, 7))
    sizes = np.linspace(top / levels, top, levels)
    both = np.concatenate([sizes, -sizes])
    order = [v for _ in range(2) for v in rng.permutation(both)]
    return [(round(float(v), 2), 0.5 * dwell) for v in order]


def _following(profile: Profile, flow: float, top: float) -> tuple[tuple[float, float], ...]:
    """A small tunnel: its water follows the thruster, as fast as the command."""
    speeds = np.round(flow * np.abs(profile.volts) / top, 3)
    return tuple(zip(profile.time.tolist(), speeds.tolist(), strict=True))


def _profile(steps: Sequence[tuple[float, float]], slew: float, dt: float, *, tare: bool = True) -> Profile:
    """As the rig runs it: tare, holds reached at the slew, zero, tare. Changes lie half a grid step before a point."""
    points = max(round(TICK / dt), 1)
    tick, now, at = points * dt, 0, 0.0
    rows, made = [(0.0, 0.0)], []

    def time() -> float:
        return max(now - 0.5, 0.0) * dt

    rests = [(0.0, TARE, "tare")] if tare else []
    for volts, seconds, phase in [*rests, *((v, s, "hold" if v else "rest") for v, s in steps), *rests]:
        begun, ramp = time(), int(np.ceil(abs(volts - at) / (slew * tick)))
        for i in range(1, ramp):
            rows.append((time(), at + (volts - at) * i / ramp))
            now += points
        if ramp > 1:
            made.append(Step("ramp", volts, begun, time()))
        if volts != at:
            rows.append((time(), volts))
        begun, at = time(), volts
        now += max(round(seconds / tick), 1) * points
        made.append(Step(phase, volts, begun, time()))
    table = np.array(rows)
    return Profile("levels", table[:, 0], table[:, 1], tuple(made), time())


@dataclass
class Bench:
    """The simulated bench in virtual time: the shell of the loop that `rig settle` is on a real one."""

    ambiguous: Ambiguous
    budget: float
    """s"""
    recordings: list[Recording] = field(default_factory=list)
    spent: float = 0.0
    """s, on the bench; computing counts nothing."""
    diagnoses: list[Diagnosis] = field(default_factory=list)

    def settle(self) -> tuple[Course, End]:
        self.recordings += recordings(self.ambiguous.case)
        course = Course(self.budget, belief(self._diagnosed()), 0.0)
        while True:
            runs = self._runs(self.diagnoses[-1].next_experiment)
            step = next_step(course, sum(run.profile.duration + OPENING for run in runs))
            if isinstance(step, End):
                return course, step
            before = self.spent
            for run in runs:
                self.recordings += recordings(replace(self.ambiguous.case, runs=(run,)))
                self.spent += run.profile.duration + OPENING
            course = course.after(self.spent - before, self.spent, self._diagnosed())

    def _diagnosed(self) -> Diagnosis:
        room = allowance(self.budget - self.spent, OPENING + 2 * TARE)
        found = diagnose(self.recordings, limits=Limits(budget=room, slew=self.ambiguous.slew))
        assert isinstance(found, Diagnosis), found
        self.diagnoses.append(found)
        return found

    def _runs(self, experiment: NextExperiment | None) -> list[Run]:
        """One for each stretch of one flow speed."""
        stretches = groupby(experiment.steps if experiment else (), key=lambda step: step.flow_speed)
        return [self._run(list(steps), flow, k) for k, (flow, steps) in enumerate(stretches)]

    def _run(self, steps: Sequence[PlanStep], flow: float, number: int) -> Run:
        first = self.ambiguous.case.runs[0]
        rng = np.random.default_rng([first.seed, len(self.recordings), number])
        holds = [(step.command_voltage, step.duration) for step in steps]
        profile = _profile(holds, self.ambiguous.slew, self.ambiguous.case.dt)
        start = first.start + sum(r.duration + PAUSE for r in self.recordings) + number * PAUSE
        tare = self.ambiguous.case.scale.thrust * float(rng.uniform(-0.02, 0.02))
        return Run(profile, ((0.0, flow),), tare, start, int(rng.integers(2**62)))
