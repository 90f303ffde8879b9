"""Blade pass in the noise: the angle that the model turns carries one phase through the whole run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.diagnosis import Diagnosis, Finding
from identification.mismatch.pipeline import diagnose
from identification.recording import Recording
from sim_devices import concealed
from tests.concealed.recordings import recording

STRENGTH = 12.0
"""Sigma at which an oracle sees it."""


def made(seed: int, noise: str) -> tuple[Recording, dict[str, float]]:
    case = concealed.case(
        np.random.default_rng(seed),
        ["periodic_disturbance"],
        STRENGTH,
        forms=["blades"],
        plan="interleaved",
        noise=noise,
        sampling=60.0,
        duration=300.0,
        channels=["rotation_rate"],
    )
    (truth,) = case.effects
    return recording(case), truth.parameters


def named(found: object) -> Finding:
    assert isinstance(found, Diagnosis)
    (finding,) = found.findings
    return finding


@pytest.mark.parametrize("noise", ["white", "mixed", "resonant"])
def test_faint_blade_pass_is_named_with_its_amplitude_and_phase(noise: str) -> None:
    measured, truth = made(4, noise)
    finding = named(diagnose([measured]))
    assert finding.effect == "periodic_disturbance"
    for name in ("amplitude", "phase"):
        value = finding.parameters[name]
        off = value.value - truth[name]
        if name == "phase":
            off = (off + np.pi) % (2 * np.pi) - np.pi
        assert abs(off) < 4 * value.std
    ratio = finding.parameters["periods_per_turn"]
    assert abs(ratio.value - truth["blades"]) < min(3 * ratio.std, 1e-3)


def test_the_scale_of_turns_has_the_error_of_the_rate() -> None:
    """Four times as noisy a rate: what periods per turn lose by it."""
    measured, _ = made(4, "white")
    rate = next(c for c in measured.channels if c.quantity == "rotation_rate")
    noise = np.random.default_rng(5).standard_normal(rate.value.size)
    errors = []
    for std in (0.1, 0.4):
        noisy = tuple(replace(c, value=c.value + std * noise) if c is rate else c for c in measured.channels)
        errors.append(named(diagnose([replace(measured, channels=noisy)])).parameters["periods_per_turn"].std)
    assert errors[1] == pytest.approx(4 * errors[0], rel=0.2)


def test_a_rate_that_wanders_is_believed() -> None:
    """A rotor that the model has a hundredth wrong, now more, now less: its measured angle carries the line."""
    measured, truth = made(4, "white")
    rate = next(c for c in measured.channels if c.quantity == "rotation_rate")
    wander = 1.0 + 0.01 * np.sin(2 * np.pi * rate.time / 45.0)
    others = tuple(replace(c, value=c.value * wander) if c is rate else c for c in measured.channels)
    thrust = next(c for c in measured.channels if c.quantity == "thrust")
    t = np.linspace(thrust.time[0], thrust.time[-1], 200_000)
    speed = np.abs(np.interp(t, rate.time, rate.value * wander))
    turns = np.interp(thrust.time, t, np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(t))]))
    wave = np.where(np.interp(thrust.time, t, speed) > 0.5, 6 * truth["amplitude"], 0.0) * np.sin(2 * np.pi * 5 * turns)
    others = tuple(replace(c, value=c.value + wave) if c is thrust else c for c in others)
    found = diagnose([replace(measured, channels=others)])
    assert isinstance(found, Diagnosis)
    lines = [f for f in found.findings if f.effect == "periodic_disturbance"]
    assert any(abs(f.parameters["periods_per_turn"].value - 5) < 0.01 for f in lines)
