"""Cases drawn at random: thruster, plan, sampling, noise, channels and effects. Same generator state, same case."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sim_devices.concealed.cases.bystanders import with_bystanders
from sim_devices.concealed.cases.definition import Case, Concealed, Run, Sensor
from sim_devices.concealed.cases.faults import fault
from sim_devices.concealed.cases.knob import Scale
from sim_devices.concealed.cases.needs import NEEDS_DRIFT, NEEDS_FLOW, NEEDS_REVERSED_FLOW, NEEDS_ROTATION, NEEDS_SLEW
from sim_devices.concealed.cases.plans import KINDS, profile
from sim_devices.concealed.cases.shapes import shape
from sim_devices.concealed.cases.wide_noise import WIDE_NOISE_KINDS, Setting, usual_hold, wide_noise
from sim_devices.concealed.cases.wiring import CHANNELS as WIRED_CHANNELS
from sim_devices.concealed.cases.wiring import wiring as miswired_runs
from sim_devices.concealed.visibility.oracle import OutOfReach, levelled, scaled_to
from sim_devices.world.noise_law import NoiseLaw, Peak, Slow, flicker
from sim_devices.world.settings import Thruster

Rng = np.random.Generator

NOISE_KINDS = ("white", "mixed", "flicker", "slow", "heavy_tailed", "resonant")
"""white; white + correlated + proportional to |thrust|; 1/f; slower than a hold; Student t; a narrow AR(2) peak."""
CHANNELS = ("rotation_rate", "current", "bus_voltage", "motor_temperature", "flow_speed")
"""Present or missing at random."""
WIRED_RATE, WIRED_DURATION = (10.0, 40.0), (60.0, 150.0)
"""1/s and s of each of several runs: channels that are exchanged show in the shortest."""
TRIES = 30
"""Cases drawn before a strength is given up."""


def case(
    rng: Rng,
    effects: Sequence[str] = (),
    strength: float = 40.0,
    *,
    forms: Sequence[str] = (),
    plan: str = "",
    noise: str = "",
    voltage: float = 0.0,
    thrust: float = 0.0,
    sampling: float = 0.0,
    duration: float = 0.0,
    channels: Sequence[str] | None = None,
    runs: int = 1,
    lie: str = "",
    wiring: str = "",
) -> Case:
    """A case in which each of `effects` is seen by the oracle at `strength` sigma (all of them there together).

    What is not given is drawn: `forms` one per effect ("" draws), `plan` of plans.KINDS, `noise` of NOISE_KINDS
    (WIDE_NOISE_KINDS by name only), `voltage` V and `thrust` N at full command, `sampling` 1/s, `duration` s of each of
    `runs` recordings, `channels` beside command and thrust (where drawn, and none lies, with bystanders). `lie`: of
    faults.KINDS, about a channel, beside the effects; none when not given. `wiring`: of wiring.KINDS or `nothing`, in
    one of several runs, which then all hold effects of field size and nothing else.
    Raises OutOfReach when no case of TRIES can show the effects so; ValueError for a name that is not known.
    """
    if wiring:
        rate, long = sampling or _log(rng, *WIRED_RATE), duration or float(rng.uniform(*WIRED_DURATION))
        return miswired_runs(
            rng, bare(rng, (), plan, noise, voltage, thrust, rate, long, WIRED_CHANNELS, 1, ""), wiring
        )
    for _ in range(TRIES):
        drawn = bare(rng, effects, plan, noise, voltage, thrust, sampling, duration, channels, runs, lie)
        if channels is None and not lie:
            drawn = with_bystanders(drawn, rng.spawn(1)[0], frozenset(effects))
        try:
            drawn = _holding(rng, drawn, effects, forms, strength)
        except OutOfReach:
            continue
        if lie:
            told = fault(lie, ["thrust", *(s.quantity for s in drawn.sensors)], drawn.scale.duration, rng)
            drawn = replace(drawn, fault=told)
        return drawn
    raise OutOfReach(f"no case of {TRIES} shows {', '.join(effects)} at {strength} sigma; expected a lower strength")


def _holding(rng: Rng, drawn: Case, effects: Sequence[str], forms: Sequence[str], strength: float) -> Case:
    """A case with these effects in it, each seen at `strength` sigma. Raises OutOfReach where it cannot show one so."""
    wanted = [*forms, *[""] * (len(effects) - len(forms))]
    for effect, form in zip(effects, wanted, strict=True):
        added = Concealed(shape(effect, drawn.scale, rng, form), 0.0)
        drawn = scaled_to(replace(drawn, effects=(*drawn.effects, added)), effect, strength)
    return levelled(drawn, strength) if len(effects) > 1 else drawn


def bare(
    rng: Rng,
    effects: Sequence[str],
    plan: str,
    noise: str,
    voltage: float,
    thrust: float,
    sampling: float,
    duration: float,
    channels: Sequence[str] | None,
    runs: int,
    lie: str,
) -> Case:
    """Thruster, runs, noise and sensors, nothing concealed yet; what `case` draws, it draws here."""
    rate = sampling or _log(rng, 20.0, 500.0)
    long = duration or float(rng.uniform(300.0, 720.0))
    named = frozenset(effects)
    top, full = voltage or _log(rng, 5.0, 48.0), thrust or _log(rng, 10.0, 300.0)
    every = max(int(np.ceil(250.0 / rate)), 1)  # a grid of 250 Hz or finer
    grid = 1.0 / (rate * every)
    scale = _scale(rng, top, full, rate, long * runs, flow=float(rng.uniform(0.4, 1.6)), grid=grid)
    with_flow = bool(named & NEEDS_FLOW) or rng.random() < 0.3
    drift = float(rng.uniform(4.0, 8.0)) * float(rng.choice((-1.0, 1.0))) if named & NEEDS_DRIFT else 0.0
    kind = plan or str(rng.choice(KINDS))
    made = [one_run(rng, scale, kind, i * long, long, named, with_flow=with_flow) for i in range(runs)]
    loud = full * _log(rng, 5e-4, 0.01)
    noise_kind = noise or str(rng.choice(NOISE_KINDS))
    forced = {"flow_speed"} if named & NEEDS_FLOW else set()
    forced |= {"rotation_rate"} if named & NEEDS_ROTATION or lie else set()
    forced |= {"current"} if lie else set()
    return Case(
        thruster=_thruster(rng, scale),
        scale=scale,
        dt=grid,
        every=every,
        first=int(rng.integers(every)),
        runs=tuple(made),
        noise_kind=noise_kind,
        noise=_noise(noise_kind, Setting(loud, rate, usual_hold(made[0].profile), long, full), rng),
        sensors=_sensors(rng, scale, grid, channels, forced, flow=with_flow, drift=drift != 0.0),
        decoys=_decoys(rng, scale, named),
        temperature_drift=drift / (long * runs),
        with_steps=bool(rng.random() < 0.7),
    )


def one_run(
    rng: Rng, scale: Scale, kind: str, start: float, long: float, named: frozenset[str], *, with_flow: bool
) -> Run:
    """One run of the plan, `long` s from `start` on of the campaign's clock."""
    flow: tuple[tuple[float, float], ...] = ((0.0, 0.0),)
    if with_flow:
        flow = flow_steps(rng, scale.flow, long, reversed_too=bool(named & NEEDS_REVERSED_FLOW))
    tare = scale.thrust * float(rng.uniform(-0.02, 0.02))
    steps = profile(kind, scale.voltage, long, scale.grid, rng, smooth=bool(named & NEEDS_SLEW))
    return Run(steps, flow, tare, start, int(rng.integers(2**62)))


def _log(rng: Rng, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _scale(rng: Rng, top: float, full: float, rate: float, duration: float, flow: float, grid: float) -> Scale:
    return Scale(
        voltage=top,
        thrust=full,
        rate=_log(rng, 8.0, 60.0),
        duration=duration,
        current=_log(rng, 3.0, 40.0),
        rise=float(rng.uniform(20.0, 60.0)),
        bus=top * float(rng.uniform(1.05, 1.8)),
        flow=flow,
        sampling=rate,
        grid=grid,
    )


def _thruster(rng: Rng, s: Scale) -> Thruster:
    drag = 0.25
    return Thruster(
        C=s.thrust / s.voltage**2,
        rate_per_volt=s.rate / s.voltage,
        drag=drag,
        torque_acceleration=drag * s.rate**2 / s.current,
        heating=s.rise / s.current**2,
        heating_time=_log(rng, 60.0, 240.0),
        rotor="instant",
    )


def flow_steps(rng: Rng, top: float, duration: float, *, reversed_too: bool) -> tuple[tuple[float, float], ...]:
    """Steps of the tunnel, begun at rest; about one in three back at rest."""
    times = np.sort(rng.uniform(0.0, duration, int(rng.integers(5, 12))))
    low = -top if reversed_too else 0.0
    speeds = [0.0 if rng.random() < 0.3 else round(float(rng.uniform(low, top)), 2) for _ in times]
    return ((0.0, 0.0), *zip(times.tolist(), speeds, strict=True))


def _noise(kind: str, s: Setting, rng: Rng) -> NoiseLaw:
    return wide_noise(kind, s, rng) if kind in WIDE_NOISE_KINDS else noise_law(kind, s.std, s.rate, rng)


def noise_law(kind: str, std: float, rate: float, rng: Rng) -> NoiseLaw:
    """A law of `kind` whose stationary standard deviation is `std` (N). Raises ValueError for an unknown kind."""
    match kind:
        case "white":
            return NoiseLaw(std)
        case "mixed":
            slow = Slow(std * float(rng.uniform(0.3, 0.8)), _log(rng, 0.1, 2.0))
            return NoiseLaw(float(np.sqrt(std**2 - slow.std**2)), proportional=_log(rng, 0.001, 0.01), slow=(slow,))
        case "flicker":
            return NoiseLaw(0.6 * std, slow=flicker(0.8 * std, 100.0, 4.0 / rate))
        case "slow":
            return NoiseLaw(0.9 * std, slow=(Slow(0.436 * std, _log(rng, 15.0, 90.0)),))
        case "heavy_tailed":
            return NoiseLaw(std, tails=float(rng.uniform(3.0, 4.0)))
        case "resonant":
            frequency = rate * float(rng.uniform(0.05, 0.4))
            return NoiseLaw(0.6 * std, peak=Peak(0.8 * std, frequency, frequency * float(rng.uniform(0.02, 0.1))))
        case _:
            known = (*NOISE_KINDS, *WIDE_NOISE_KINDS)
            raise ValueError(f"noise must be one of {', '.join(known)}, got {kind!r}")


def _sensors(
    rng: Rng, s: Scale, dt: float, channels: Sequence[str] | None, forced: set[str], *, flow: bool, drift: bool
) -> tuple[Sensor, ...]:
    """Each on a clock of its own, at a rate that such a sensor has."""
    made = {
        "rotation_rate": ("rev/s", (10.0, 100.0), s.rate * _log(rng, 2e-4, 2e-3)),
        "current": ("A", (10.0, 100.0), s.current * _log(rng, 2e-3, 2e-2)),
        "bus_voltage": ("V", (2.0, 50.0), s.bus * _log(rng, 2e-4, 2e-3)),
        "motor_temperature": ("degC", (0.5, 5.0), _log(rng, 0.05, 0.4)),
        "flow_speed": ("m/s", (1.0, 10.0), s.flow * _log(rng, 2e-3, 2e-2)),
        "water_temperature": ("degC", (0.5, 2.0), _log(rng, 0.005, 0.05)),
    }
    if channels is None:
        chosen = {c for c in CHANNELS if rng.random() < 0.6 and (flow or c != "flow_speed")} | forced
        chosen |= {"water_temperature"} if drift else set()
    else:
        chosen = set(channels)
    if chosen - set(made):
        raise ValueError(f"channels: expected some of {', '.join(made)}, got {sorted(chosen - set(made))}")
    sensors = []
    for quantity, (unit, (low, high), std) in made.items():
        every = max(round(1.0 / (dt * _log(rng, low, high))), 1)
        first = int(rng.integers(every))
        if quantity in chosen:
            sensors.append(Sensor(quantity, unit, every, first, NoiseLaw(std)))
    return tuple(sensors)


def _decoys(rng: Rng, s: Scale, named: frozenset[str]) -> dict[str, dict[str, float]]:
    """In a third of the cases the supply sags and the drive makes up for it: the bus moves, the thrust does not."""
    if "supply_sag" in named or rng.random() > 1.0 / 3.0:
        return {}
    drawn = s.current * s.voltage / s.bus
    return {"supply_sag": {"source_resistance": 0.08 * s.bus / drawn, "exponent": 0.0}}
