"""Rotor inertia of a vehicle's thrusters: the rate follows the command with a first-order lag."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.signal import lfilter

from identification.physics.term import Parameter
from identification.physics.vehicle.term import Scale, Stage, Untouched, VehicleContext
from identification.recording import Floats


@dataclass(frozen=True, slots=True)
class MotorLag(Untouched):
    """x' = (V - x)/tau for each thruster; thrust is that of x."""

    id: ClassVar[str] = "motor_lag"
    stage: ClassVar[Stage] = "command"
    physics: ClassVar[str] = "the rotors need time to follow"
    covariates: ClassVar[tuple[str, ...]] = ("time_since_step",)
    form: str = "first_order"

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        return (Parameter("time_constant", "s", 0.0, min(10.0, 0.1 * scale.duration), 0.0),)

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        most = min(10.0, 0.1 * scale.duration)
        return tuple((tau,) for tau in (0.1, 0.3, 1.0, 3.0) if tau <= 0.5 * most)

    def on_volts(self, volts: Floats, now: VehicleContext, theta: tuple[float, ...]) -> Floats:
        tau = theta[0]
        looks = volts.shape[2]
        dt = now.step / looks
        if tau <= 1e-3 * dt:
            return volts
        flat = volts.reshape(volts.shape[0], -1)
        keep = float(np.exp(-dt / tau))
        begin = flat[:, :1]
        # mean over a look of the exact answer to a held voltage, from the state at its start
        ends, _ = lfilter([1 - keep], [1.0, -keep], flat, axis=1, zi=keep * begin)
        starts = np.hstack([begin, ends[:, :-1]])
        mean: Floats = flat + (starts - flat) * (1 - keep) * tau / dt
        return mean.reshape(volts.shape)

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        return f"Motor lag: the thrusters follow the command with a time constant of {1000 * theta[0]:.3g} ms."


FORMS = (MotorLag(),)
