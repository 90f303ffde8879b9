"""Channels that lie are found and named, repaired only on request, and no honest channel is accused."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.faults import wiring
from identification.mismatch.faults.channel_faults import Fault, find_faults, repaired
from identification.recording import Channel, Floats, Recording
from sim_devices import concealed
from sim_devices.concealed.cases.shapes import SHAPES
from tests.concealed.recordings import recordings

SEEDS = 6
SAME_LAW = {"thrust", "current"}
"""A swap of these cannot be known: both go as the square of the command."""


def lying(kind: str, seed: int) -> tuple[concealed.Case, tuple[Fault, ...]]:
    case = concealed.case(np.random.default_rng(seed), lie=kind, sampling=40.0)
    return case, find_faults(recordings(case))


@pytest.mark.parametrize("kind", concealed.LIES)
def test_lies_of_the_simulated_bench_are_found(kind: str) -> None:
    right = known = 0
    for seed in range(SEEDS):
        case, found = lying(kind, seed)
        assert case.fault is not None
        named = {str(case.fault["channel"]), str(case.fault.get("other", case.fault["channel"]))}
        if named == SAME_LAW:
            assert not found
            continue
        known += 1
        right += any(f.kind == kind and f.channel in named for f in found)
        assert all(f.kind == kind and f.channel in named for f in found), "an honest channel was accused"
    assert known >= 3
    assert right >= known - 1


@pytest.mark.parametrize("effect", sorted(SHAPES))
def test_no_physics_is_a_fault(effect: str) -> None:
    """150 more such cases of all effects, up to 100 sigma, and 24 clean ones: none when this was written."""
    case = concealed.case(np.random.default_rng(len(effect)), [effect], 60.0, sampling=30.0, duration=300.0)
    assert find_faults(recordings(case)) == ()


def test_no_fault_in_clean_recordings() -> None:
    for seed in range(8):
        assert find_faults(recordings(concealed.case(np.random.default_rng(seed), sampling=30.0))) == ()


def bench(seed: int = 0, scale: float = 1.0) -> Recording:
    """Steps of both signs at 50 Hz, a command, a drive, a supply and everything else a bench has."""
    rng = np.random.default_rng(seed)
    t = np.arange(6000) / 50
    length = np.array([250, 50] * 20)  # rows of a level
    level = rng.uniform(-20, 20, 40)
    V = np.repeat(level, length)
    start = np.cumsum(length) - length
    return Recording(
        f"run{seed}",
        "T",
        (
            channel("command_voltage", "V", t[start], level),
            channel("thrust", "N", t, 0.4 * scale * V * np.abs(V) + 2.0 + rng.normal(0, 0.5, t.size)),
            channel("rotation_rate", "rev/s", t, 1.5 * V + rng.normal(0, 0.02, t.size)),
            channel("motor_voltage", "V", t, 0.97 * V + rng.normal(0, 0.02, t.size)),
            channel("current", "A", t, 0.03 * V * np.abs(V) + rng.normal(0, 0.05, t.size)),
            channel("bus_voltage", "V", t, 24 - 0.002 * V**2 + rng.normal(0, 0.01, t.size)),
            channel("flow_speed", "m/s", t, rng.normal(0, 0.01, t.size)),
        ),
    )


def channel(quantity: str, unit: str, time: Floats, value: Floats) -> Channel:
    return Channel(quantity, quantity, quantity, unit, time, value)


def changed(recording: Recording, quantity: str, change: Callable[[Channel], Floats]) -> Recording:
    return replace(
        recording,
        channels=tuple(replace(c, value=change(c)) if c.quantity == quantity else c for c in recording.channels),
    )


def swapped(recording: Recording, a: str, b: str) -> Recording:
    first, second = recording.first_of(a), recording.first_of(b)
    assert first is not None
    assert second is not None
    exchange = {
        a: replace(first, time=second.time, value=second.value),
        b: replace(second, time=first.time, value=first.value),
    }
    return replace(recording, channels=tuple(exchange.get(str(c.quantity), c) for c in recording.channels))


def test_the_bench_of_these_tests_is_honest() -> None:
    assert find_faults([bench(0), bench(1)]) == ()


FAULTY: dict[str, tuple[str, str, Callable[[Recording], Recording]]] = {
    "thrust and rate swapped": ("swapped", "rotation_rate", lambda r: swapped(r, "thrust", "rotation_rate")),
    "command and motor voltage swapped": (
        "swapped",
        "command_voltage",
        lambda r: swapped(r, "command_voltage", "motor_voltage"),
    ),
    "rate and bus swapped": ("swapped", "rotation_rate", lambda r: swapped(r, "rotation_rate", "bus_voltage")),
    "bus and flow swapped": ("swapped", "flow_speed", lambda r: swapped(r, "bus_voltage", "flow_speed")),
    "thrust reversed": ("reversed", "thrust", lambda r: changed(r, "thrust", lambda c: -c.value)),
    "rate reversed": ("reversed", "rotation_rate", lambda r: changed(r, "rotation_rate", lambda c: -c.value)),
    "command reversed": ("reversed", "command_voltage", lambda r: changed(r, "command_voltage", lambda c: -c.value)),
    "rate in rpm": ("rescaled", "rotation_rate", lambda r: changed(r, "rotation_rate", lambda c: 60 * c.value)),
    "bus in mV": ("rescaled", "bus_voltage", lambda r: changed(r, "bus_voltage", lambda c: 1000 * c.value)),
    "motor voltage in mV": (
        "rescaled",
        "motor_voltage",
        lambda r: changed(r, "motor_voltage", lambda c: 1e3 * c.value),
    ),
    "thrust in kgf from half way": (
        "rescaled",
        "thrust",
        lambda r: changed(r, "thrust", lambda c: np.where(c.time > 60, c.value / 9.80665, c.value)),
    ),
    "rate in rpm from half way": (
        "rescaled",
        "rotation_rate",
        lambda r: changed(r, "rotation_rate", lambda c: np.where(c.time > 60, 60 * c.value, c.value)),
    ),
    "thrust frozen": (
        "frozen",
        "thrust",
        lambda r: changed(r, "thrust", lambda c: np.where(c.time > 80, c.value[4010], c.value)),
    ),
    "rate dead": ("frozen", "rotation_rate", lambda r: changed(r, "rotation_rate", lambda c: 0 * c.value)),
    "tachometer unsigned": ("unsigned", "rotation_rate", lambda r: changed(r, "rotation_rate", lambda c: abs(c.value))),
    "thrust unsigned": ("unsigned", "thrust", lambda r: changed(r, "thrust", lambda c: abs(c.value))),
    "thrust silent": (
        "nan",
        "thrust",
        lambda r: changed(r, "thrust", lambda c: np.where(c.time % 1 > 0.8, np.nan, c.value)),
    ),
    "current never there": ("nan", "current", lambda r: changed(r, "current", lambda c: c.value * np.nan)),
}


@pytest.mark.parametrize("what", FAULTY)
def test_each_fault_alone(what: str) -> None:
    kind, quantity, spoil = FAULTY[what]
    honest = bench()
    spoilt = spoil(honest)
    found = find_faults([spoilt])
    assert [(f.kind, f.channel) for f in found] == [(kind, quantity)]
    (fault,) = found
    assert fault.statement.endswith(".")
    assert fault.grave
    mended = repaired(spoilt, fault)
    if kind == "nan":
        assert mended is spoilt
        return
    assert find_faults([mended]) == () or kind == "frozen"
    for before, after in zip(honest.channels, mended.channels, strict=True):
        size = float(np.max(np.abs(before.value)))
        if before.time.size == after.time.size and kind != "frozen":
            assert np.median(np.abs(before.value - after.value)) < 0.02 * size


def test_factor_of_a_change_with_its_uncertainty() -> None:
    spoil = FAULTY["thrust in kgf from half way"][2]
    (fault,) = find_faults([spoil(bench())])
    factor, start = fault.parameters["factor"], fault.parameters["start"]
    assert abs(factor.value - 1 / 9.80665) < 6 * factor.std + 1e-4
    assert abs(start.value - 60) < 0.5
    assert "kilogram-force" in fault.statement


def test_an_unsigned_current_is_told_and_is_not_grave() -> None:
    (fault,) = find_faults([changed(bench(), "current", lambda c: abs(c.value))])
    assert (fault.kind, fault.channel, fault.grave) == ("unsigned", "current", False)


@pytest.mark.parametrize("runs", [2, 3])
def test_one_run_in_another_unit(runs: int) -> None:
    honest = [bench(seed) for seed in range(runs)]
    honest[1] = changed(bench(1), "thrust", lambda c: c.value / 4.4482216)
    found = wiring.run(honest, ())
    (fault,) = found.faults
    assert (fault.kind, fault.channel, fault.recording_id) == ("rescaled", "thrust", "run1")
    assert wiring.run(found.recordings, ()).faults == ()


def test_a_clipped_cell_is_not_frozen() -> None:
    assert find_faults([changed(bench(), "thrust", lambda c: np.clip(c.value, -40, 40))]) == ()


def test_a_coarse_channel_at_rest_is_not_frozen() -> None:
    honest = bench()
    command = honest.first_of("command_voltage")
    assert command is not None
    rest = changed(honest, "command_voltage", lambda c: np.where(c.time > 60, 0.0, c.value))
    for quantity in ("thrust", "rotation_rate", "current", "motor_voltage"):
        rest = changed(rest, quantity, lambda c: np.where(c.time > 60, 0.0, np.round(c.value)))
    assert find_faults([rest]) == ()


def test_vehicles_and_recordings_without_a_driver_are_left_alone() -> None:
    honest = bench()
    assert find_faults([replace(honest, kind="vehicle")]) == ()
    only_thrust = replace(honest, channels=tuple(c for c in honest.channels if c.quantity == "thrust"))
    assert find_faults([only_thrust]) == ()
    assert find_faults([]) == ()
