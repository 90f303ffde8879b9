"""A bench, a campaign and what is concealed in it, drawn. Same generator state, same case."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sim_devices.concealed.cases.definition import Case, Concealed, Run, Sensor
from sim_devices.concealed.cases.knob import Scale, Shape
from sim_devices.concealed.cases.needs import NEEDS_DRIFT, NEEDS_FLOW
from sim_devices.concealed.cases.shapes import SHAPES, shape
from sim_devices.concealed.visibility.oracle import OutOfReach, levelled, scaled_to
from sim_devices.recorded.benches import Bench, bench
from sim_devices.recorded.campaign import PLANS, Campaign, campaign, expected
from sim_devices.world.noise_law import NoiseLaw, Slow
from sim_devices.world.settings import Thruster

Rng = np.random.Generator

EFFECTS = tuple(e for e in SHAPES if e not in NEEDS_FLOW | NEEDS_DRIFT | {"thruster_interaction"})
"""What a run at rest water, alone on its bench, can show."""
LEAST_LATE = 0.012
"""s; a recording of the rig states its commands and its stamps to 2 ms (1 sigma)."""
MOST_CREEP = 0.05
"""Of the load, that comes late with the first time constant (a second has up to 1.5 times as much): more is no cell,
however cheap (class C3 of OIML R 60 has 0.0003)."""
TRIES = 30
FINEST = 0.002
"""s: the world's longest step, and about that of the grid on which strengths are found."""


@dataclass(frozen=True, slots=True)
class Drawn:
    """`case` has the command that is expected; what was commanded is known when it was run."""

    bench: Bench
    campaign: Campaign
    case: Case


def drawn(
    rng: Rng, on: str, effects: Sequence[str] = (), strength: float = 40.0, plan: str = "", duration: float = 0.0
) -> Drawn:
    """A case on the bench `on` in which each effect is seen by the oracle at `strength` sigma.

    `plan` of PLANS and `duration` (s) are drawn where they are not given. Raises OutOfReach when no case of TRIES can
    show the effects so, ValueError for a name that is not known or needs more than such a bench has.
    """
    if unknown := set(effects) - set(EFFECTS):
        raise ValueError(f"effects: expected some of {', '.join(EFFECTS)}, got {', '.join(sorted(unknown))}")
    for _ in range(TRIES):
        found = _bare(rng, on, plan, duration)
        case = found.case
        try:
            for effect in effects:
                added = Concealed(_of_a_bench(effect, shape(effect, case.scale, rng)), 0.0)
                case = scaled_to(replace(case, effects=(*case.effects, added)), effect, strength)
            case = levelled(case, strength) if len(effects) > 1 else case
        except OutOfReach:
            continue
        return replace(found, case=case)
    raise OutOfReach(f"no case of {TRIES} shows {', '.join(effects)} at {strength} sigma; expected a lower strength")


def _of_a_bench(effect: str, made: Shape) -> Shape:
    """In sizes that a bench has: what comes late does so by more than the recording says that it does not know (within
    that it is no finding), and no cell creeps without end. Where an amount ends there, the noise meets the strength."""
    if effect in ("time_skew", "motor_lag"):
        return replace(made, lowest=LEAST_LATE)
    return replace(made, highest=MOST_CREEP) if effect == "load_cell_creep" else made


def _bare(rng: Rng, on: str, plan: str, duration: float) -> Drawn:
    """Thruster, bench, campaign and noise, nothing concealed yet."""
    top, full = round(_log(rng, 6.0, 40.0), 1), _log(rng, 10.0, 300.0)
    bus = round(top * float(rng.uniform(1.1, 1.8)), 1)
    on_bench = bench(on, full, bus, rng)
    made = campaign(plan or str(rng.choice(PLANS)), top, duration or float(rng.uniform(100.0, 240.0)), rng)
    rate = on_bench.cell.rate
    every = max(int(np.ceil(1.0 / (rate * FINEST))), 1)
    dt = 1.0 / (rate * every)
    laid = expected(made, top, on_bench.loop_rate, dt)
    scale = Scale(
        voltage=top, thrust=full, rate=_log(rng, 8.0, 60.0), duration=laid.duration, current=_log(rng, 3.0, 40.0),
        rise=float(rng.uniform(20.0, 60.0)), bus=bus, flow=1.0, sampling=rate, grid=dt,
    )  # fmt: skip
    tare = full * float(rng.uniform(-0.02, 0.02))
    loud = max(full * _log(rng, 5e-4, 0.01), 0.5 * on_bench.cell.quantum)
    kind, law = _noise(loud, rng)
    case = Case(
        thruster=_thruster(scale, rng), scale=scale, dt=dt, every=every, first=0,
        runs=(Run(laid, ((0.0, 0.0),), tare, 0.0, int(rng.integers(2**62))),), noise_kind=kind, noise=law,
        sensors=_sensors(scale, dt, rng), amplifier=on_bench.cell.amplifier,
    )  # fmt: skip
    return Drawn(on_bench, made, case)


def _noise(std: float, rng: Rng) -> tuple[str, NoiseLaw]:
    """White, or half of it slower than a hold of some tenths of a second."""
    if rng.random() < 0.5:
        return "white", NoiseLaw(std)
    slow = Slow(std * float(rng.uniform(0.2, 0.6)), _log(rng, 0.1, 2.0))
    return "mixed", NoiseLaw(float(np.sqrt(std**2 - slow.std**2)), slow=(slow,))


def _thruster(s: Scale, rng: Rng) -> Thruster:
    drag = 0.25
    return Thruster(
        C=s.thrust / s.voltage**2, rate_per_volt=s.rate / s.voltage, drag=drag,
        torque_acceleration=drag * s.rate**2 / s.current, heating=s.rise / s.current**2,
        heating_time=_log(rng, 60.0, 240.0), rotor="instant",
    )  # fmt: skip


def _sensors(s: Scale, dt: float, rng: Rng) -> tuple[Sensor, ...]:
    """What the motor controller tells, on the grid of the other run that is to be predicted."""
    made = {
        "rotation_rate": ("rev/s", 50.0, s.rate * _log(rng, 2e-4, 2e-3)),
        "current": ("A", 50.0, s.current * _log(rng, 2e-3, 2e-2)),
        "bus_voltage": ("V", 50.0, s.bus * _log(rng, 2e-4, 2e-3)),
        "motor_temperature": ("degC", 5.0, _log(rng, 0.05, 0.4)),
    }
    return tuple(Sensor(q, u, max(round(1.0 / (dt * rate)), 1), 0, NoiseLaw(std)) for q, (u, rate, std) in made.items())


def _log(rng: Rng, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))
