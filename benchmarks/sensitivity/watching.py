"""Live watching: delay to the alarm when an effect begins midway, and alarms in clean hours.

    python benchmarks/sensitivity/watching.py changes [CAMPAIGNS [SIGMA]]    # 50, 40: drift, fouling, sag in turn
    python benchmarks/sensitivity/watching.py clean [HOURS]                  # 20: every kind of noise in turn

Recordings are concealed ones (sim_devices.concealed): thruster, plan, sampling, noise and channels drawn at random; an
effect begins between 40 and 60 % of the run, as strong as an oracle sees it at so many sigma over the whole run that
knows shape, beginning and noise, and that the static curve is exactly C V|V|. They are fed second by second.
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = "1"

import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
import numpy as np

from identification.recording import Floats
from identification.watching import Alarm, Settings, Watch
from sim_devices import concealed
from sim_devices.concealed.cases.definition import Case, Concealed
from sim_devices.concealed.cases.knob import Scale, Shape

EFFECTS = ("zero_drift", "fouling", "supply_sag")
RIGHT = {
    "zero_drift": {"zero"},
    "fouling": {"running"},
    "supply_sag": {"bus"},
}
"""Places that are right. A sag whose bus is not recorded is a loss at high levels."""
UNSEEN_SAG = {"high", "running"}
BLOCK = 1.0
"""s fed at once."""


@dataclass(frozen=True)
class Watched:
    watch: Watch
    first: Alarm | None
    duration: float
    cost: float
    """s of processor per s watched."""


def watched(case: Case) -> Watched:
    """The only run of a case, fed as it would have come; the watch goes on after the alarm."""
    (run,) = concealed.rows(case)
    columns = {c.quantity: c for c in run.columns if not c.thruster}
    watch = Watch(Settings(highest=case.scale.voltage))
    takes = {
        "bus_voltage": watch.bus_voltage,
        "flow_speed": watch.flow_speed,
        "rotation_rate": watch.rotation_rate,
        "thrust": watch.thrust,
    }
    command, first = columns["command_voltage"], None
    cuts = np.unique(np.concatenate([command.time, np.arange(0.0, run.duration, BLOCK), [run.duration]]))
    volts = dict(zip(command.time.tolist(), command.value.tolist(), strict=True))
    began = time.process_time()
    for start, end in zip(cuts[:-1].tolist(), cuts[1:].tolist(), strict=True):
        if start in volts:
            watch.command(start, volts[start])
        for quantity, take in takes.items():
            if quantity in columns:
                times, values = _between(columns[quantity], start, end)
                take(times, values)
        first = watch.look() if first is None else first
        watch.look()
    return Watched(watch, first, run.duration, (time.process_time() - began) / run.duration)


def _between(column: concealed.Column, start: float, end: float) -> tuple[Floats, Floats]:
    i, j = np.searchsorted(column.time, (start, end))
    return column.time[i:j], column.value[i:j]


def shape(effect: str, s: Scale, start: float, rng: np.random.Generator) -> Shape:
    """One that begins at `start` (s); as in concealed.cases.shapes otherwise."""
    if effect == "zero_drift":
        sign = float(rng.choice((-1.0, 1.0)))
        return Shape("zero_drift", "rate", 0.5, sign * s.thrust / s.duration, fixed={"start": start})
    if effect == "fouling":
        fixed = {"start": start, "time_constant": s.duration * float(rng.uniform(0.05, 0.2))}
        return Shape("fouling", "amount", 0.8, fixed=fixed)
    drawn = s.current * s.voltage / s.bus
    return Shape("supply_sag", "source_resistance", 0.3, s.bus / drawn, fixed={"start": start})


def changing(rng: np.random.Generator, effect: str, sigma: float) -> tuple[Case, float]:
    """A case whose effect begins midway, and when."""
    while True:
        seconds, rate = float(rng.uniform(300.0, 480.0)), float(np.exp(rng.uniform(np.log(20.0), np.log(120.0))))
        case = replace(concealed.case(rng, duration=seconds, sampling=rate), decoys={})
        start = case.scale.duration * float(rng.uniform(0.4, 0.6))
        case = replace(case, effects=(Concealed(shape(effect, case.scale, start, rng), 0.0),))
        try:
            return concealed.scaled_to(case, effect, sigma), start
        except concealed.OutOfReach:
            continue


def is_right(effect: str, case: Case, place: str) -> bool:
    """A sag is seen with the bus where that is recorded."""
    recorded = any(sensor.quantity == "bus_voltage" for sensor in case.sensors)
    right = UNSEEN_SAG if effect == "supply_sag" and not recorded else RIGHT[effect]
    return place in right


def changes(campaigns: int, sigma: float) -> None:
    delays: dict[str, list[float]] = {effect: [] for effect in EFFECTS}
    counts = dict.fromkeys(("early", "missed", "right at once", "right at the end"), 0)
    off: list[float] = []
    for number in range(campaigns):
        effect = EFFECTS[number % len(EFFECTS)]
        case, start = changing(np.random.default_rng([number, round(sigma), 8]), effect, sigma)
        found = watched(case)
        about = f"{sigma:3.0f} sigma {number:3d} {effect:<10} {case.noise_kind:<12} {case.runs[0].profile.kind:<11}"
        about += f" begins {start:3.0f} of {found.duration:3.0f} s: "
        if found.first is None or found.watch.alarm is None:
            counts["missed"] += 1
            delays[effect].append(np.inf)
            print(f"{about} no alarm", flush=True)
            continue
        first, last = found.first, found.watch.alarm
        if first.time < start:
            counts["early"] += 1
            print(f"{about} AN ALARM BEFORE IT BEGAN, {first.headline}", flush=True)
            continue
        counts["right at once"] += is_right(effect, case, first.place)
        counts["right at the end"] += is_right(effect, case, last.place)
        delays[effect].append(first.time - start)
        off.append(first.began - start)
        print(f"{about} after {first.time - start:4.0f} s: {first.headline}; in the end {last.headline}", flush=True)
    everything = np.concatenate([np.array(d) for d in delays.values()])
    print(f"{sigma:g} sigma: {counts} of {campaigns}, early ones in no delay; delay {_spread(everything)}")
    for effect, found_after in delays.items():
        print(f"  {effect}: delay {_spread(np.array(found_after))}")
    print(f"  begin as first said minus true: {_spread(np.array(off))}", flush=True)


def _spread(values: Floats) -> str:
    if not values.size:
        return "of none"
    low, middle, high = np.quantile(values, (0.1, 0.5, 0.9), method="nearest")
    return f"median {middle:.0f} s, 10 % {low:.0f} s, 90 % {high:.0f} s (n = {values.size})"


def clean(hours: float) -> None:
    alarms = dict.fromkeys(concealed.NOISE_KINDS, 0)
    seconds = dict.fromkeys(concealed.NOISE_KINDS, 0.0)
    costs, number = [], 0
    while sum(seconds.values()) < hours * 3600:
        kind = concealed.NOISE_KINDS[number % len(concealed.NOISE_KINDS)]
        rng = np.random.default_rng([number, 9])
        case = concealed.case(rng, noise=kind, sampling=float(np.exp(rng.uniform(np.log(20.0), np.log(120.0)))))
        found = watched(case)
        alarms[kind] += found.first is not None
        seconds[kind] += found.duration
        costs.append(found.cost)
        number += 1
        if found.first is not None:
            print(f"{number:4d} {kind:<12} {case.runs[0].profile.kind:<11} {found.first.statement}", flush=True)
        elif number % 12 == 0:
            print(f"{number:4d} runs, {sum(seconds.values()) / 3600:.1f} h: {sum(alarms.values())} alarms", flush=True)
    for kind in concealed.NOISE_KINDS:
        print(f"{kind:<12} {alarms[kind]} alarms in {seconds[kind] / 3600:.2f} h")
    total = sum(seconds.values()) / 3600
    print(f"all: {sum(alarms.values())} alarms in {number} runs, {total:.1f} h; stated: at most {0.05 * total:.1f}")
    print(f"processor: {1e3 * float(np.mean(costs)):.1f} ms per s watched")


if __name__ == "__main__":
    what, *amount = sys.argv[1:] or ["changes"]
    if what == "clean":
        clean(float(amount[0]) if amount else 20.0)
    else:
        changes(int(amount[0]) if amount else 50, float(amount[1]) if amount[1:] else 40.0)
