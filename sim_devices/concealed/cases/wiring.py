"""Runs of one thruster in one of which something is wired, scaled or driven otherwise, effects of field size in all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from sim_devices.concealed.cases.bystanders import with_bystanders
from sim_devices.concealed.cases.definition import Case, Concealed, Run
from sim_devices.concealed.cases.faults import Column
from sim_devices.concealed.cases.field_size import FIELD, of_field_size
from sim_devices.concealed.cases.plans import KINDS as PLAN_KINDS
from sim_devices.concealed.cases.plans import profile

Rng = np.random.Generator

KINDS = (
    "current_for_command",
    "bus_for_command",
    "current_rescaled",
    "thrust_unit",
    "thrust_reversed",
    "rate_unit",
    "driver_changed",
    "thrust_strange",
)
NOTHING = "nothing"
"""Runs of one thruster in which nothing is wired otherwise."""
CHANNELS = ("rotation_rate", "current", "bus_voltage")
"""Recorded in every run: without a third channel beside command and thrust nobody can say which of the two changed."""
THRUST_UNITS = {"lbf": 1 / 4.4482216152605, "gf": 1000 / 9.80665, "kgf": 1 / 9.80665}
"""What a reading of 1 N is in it."""
RATE_UNITS = {"rpm": 60.0, "rad/s": 2 * np.pi}
"""What 1 rev/s is in it."""


def wiring(rng: Rng, bare: Case, kind: str) -> Case:
    """`bare` with effects of field size, two runs (three in every third case) and the fault `kind` in one of them.

    Raises ValueError for a kind that is not known.
    """
    if kind not in (*KINDS, NOTHING):
        raise ValueError(f"wiring must be one of {', '.join((*KINDS, NOTHING))}, got {kind!r}")
    case = with_bystanders(
        replace(bare, runs=_runs(rng, bare), effects=_effects(rng, bare)), rng.spawn(1)[0], frozenset()
    )
    if kind == NOTHING:
        return case
    at = int(rng.integers(len(case.runs)))
    told = {"kind": kind, "run": at, **_drawn(kind, rng)}
    if kind == "driver_changed":
        runs = list(case.runs)
        runs[at] = replace(runs[at], drive=told["factor"])
        case = replace(case, runs=tuple(runs))
    return replace(case, fault=told)


def _effects(rng: Rng, bare: Case) -> tuple[Concealed, ...]:
    """Two to five of them."""
    names = sorted(rng.choice(sorted(FIELD), int(rng.integers(2, 6)), replace=False).tolist())
    return of_field_size(names, bare, rng)


def _runs(rng: Rng, bare: Case) -> tuple[Run, ...]:
    """Each of a plan of its own, up to 60 to 100 % of the largest command; the first reaches all of it."""
    first, long = bare.runs[0], bare.runs[0].profile.duration
    made = [first]
    for i in range(1, 3 if rng.random() < 1 / 3 else 2):
        top = bare.scale.voltage * float(rng.uniform(0.6, 1.0))
        laid = profile(str(rng.choice(PLAN_KINDS)), top, long, bare.dt, rng)
        tare = bare.scale.thrust * float(rng.uniform(-0.02, 0.02))
        made.append(Run(laid, first.flow, tare, i * long, int(rng.integers(2**62))))
    return tuple(made)


def _drawn(kind: str, rng: Rng) -> dict[str, Any]:
    """What there is to draw of a fault."""
    match kind:
        case "current_rescaled":
            size = float(np.exp(rng.uniform(np.log(1.6), np.log(3.0))))
            return {"channel": "current", "factor": size if rng.random() < 0.5 else 1 / size}
        case "thrust_unit" | "rate_unit":
            units = THRUST_UNITS if kind == "thrust_unit" else RATE_UNITS
            unit = str(rng.choice(list(units)))
            channel = "thrust" if kind == "thrust_unit" else "rotation_rate"
            return {"channel": channel, "unit": unit, "factor": units[unit]}
        case "driver_changed":
            return {"channel": "command_voltage", "factor": float(rng.uniform(0.6, 0.85))}
        case "thrust_strange":
            return {"channel": "thrust", "followed": float(rng.uniform(0.0, 0.3)), "seed": int(rng.integers(2**31))}
        case "thrust_reversed":
            return {"channel": "thrust", "factor": -1.0}
        case _:
            return {
                "channel": "command_voltage",
                "other": "current" if kind == "current_for_command" else "bus_voltage",
            }


def miswired(columns: Sequence[Column], told: Mapping[str, Any]) -> tuple[Column, ...]:
    """The columns of the run that the fault is in."""
    mine = {c.quantity: c for c in columns if not c.thruster}
    if told["kind"] == "driver_changed":
        return tuple(columns)
    if "other" in told:
        one, other = mine[told["channel"]], mine[told["other"]]
        new = {
            one.quantity: replace(one, time=other.time, value=other.value),
            other.quantity: replace(other, time=one.time, value=one.value),
        }
    else:
        channel = mine[told["channel"]]
        value = _strange(channel, told) if told["kind"] == "thrust_strange" else channel.value * told["factor"]
        new = {channel.quantity: replace(channel, value=value)}
    return tuple(c if c.thruster else new.get(c.quantity, c) for c in columns)


def _strange(channel: Column, told: Mapping[str, Any]) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Noise as large as the channel was, a share `followed` of its variance is still the channel's own."""
    rng = np.random.default_rng(told["seed"])
    value, share = channel.value, told["followed"]
    middle, size = float(np.mean(value)), float(np.std(value))
    reach = max(int(value.size / channel.time[-1] * 2.0), 1)
    slow = np.convolve(rng.normal(size=value.size + reach - 1), np.ones(reach) / np.sqrt(reach), "valid")
    noise = (slow + rng.normal(size=value.size)) / np.sqrt(2)
    out: np.ndarray[Any, np.dtype[np.float64]] = (
        middle + np.sqrt(share) * (value - middle) + np.sqrt(1 - share) * size * noise
    )
    return out
