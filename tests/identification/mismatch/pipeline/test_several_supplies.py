"""One thruster recorded at several supplies: what it is referred to is one for fitted, held out and twin."""

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.diagnosis import Diagnosis
from identification.mismatch.pipeline import diagnose
from identification.recording import Channel, Recording
from tests.identification.diagnosed_runs import C, dead_band, run, table

FULL = 18.0
"""V, the highest supply that is fitted."""
HELD_OUT = 16.0


def felt(volts: np.ndarray, supply: float) -> np.ndarray:
    """The duty is of the supply, whatever the command was meant for."""
    return dead_band(0.6)(volts * supply / FULL)


def with_supply(recording: Recording, supply: float, time: np.ndarray) -> Recording:
    bus = Channel("bus_voltage", "motor", "bus_voltage", "V", time, np.full(time.size, supply))
    channels = (*recording.channels, bus)
    return replace(recording, recording_id=f"{supply:g} V", channels=channels)


def levels(supply: float, seed: int) -> Recording:
    def thrust(volts: np.ndarray) -> np.ndarray:
        x = felt(volts, supply)
        return C * x * np.abs(x) * np.where(volts < 0, 0.8, 1.0)

    made = table(thrust, seed=seed)
    return with_supply(made, supply, made.channels[0].time + 2.0)


def moving(supply: float, seed: int) -> Recording:
    return with_supply(run(seed=seed, volts=lambda V: felt(V, supply)), supply, np.arange(0.0, 150.0))


@pytest.mark.parametrize(("made", "names"), [(levels, {"supply_sag", "dead_band", "asymmetry"}), (moving, None)])
def test_supplies_that_differ_between_runs_are_seen_and_a_run_at_another_is_predicted(made, names) -> None:
    found = diagnose([made(volts, i) for i, volts in enumerate((12.0, 14.0, FULL))], [made(HELD_OUT, 9)])
    assert isinstance(found, Diagnosis)
    assert {f.effect for f in found.findings} == (names or {"supply_sag", "dead_band"})
    sag = next(f for f in found.findings if f.effect == "supply_sag")
    assert sag.parameters["exponent"].value == pytest.approx(1.0, abs=0.01)
    assert f"{FULL:g} V" in sag.statement
    assert found.heldout.after < 1.2 * found.heldout.noise < 0.2 * found.heldout.before


def test_a_twin_keeps_the_voltage_that_its_supply_is_referred_to() -> None:
    first = diagnose([moving(volts, i) for i, volts in enumerate((12.0, FULL))])
    assert isinstance(first, Diagnosis)
    assert first.twin is not None
    assert {t.effect: t.scale.bus for t in first.twin.terms}["supply_sag"] == pytest.approx(FULL, rel=1e-6)
    again = diagnose([moving(HELD_OUT, 5)], baseline=first.twin)
    assert isinstance(again, Diagnosis)
    assert again.verdict == "adequate"
    assert again.model["C"].value == pytest.approx(C, rel=0.01)
