"""What the world is doing now. Written by the world, read by effects, sensors and the truth log."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(slots=True)
class State:
    """One instant. SI, rotation in rev/s, temperatures as rises in K."""

    t: float = 0.0
    """s since the start of the world."""
    command: float = 0.0
    """V the drive means to apply, before any effect; 0 when released."""
    volts: float = 0.0
    """V that the rotor answers to, after the effects of the stages command and motor."""
    terminals: float = 0.0
    """V at the motor, before what winding and magnets make of it."""
    flux: float = 1.0
    """Of the magnets, of what they have when cold: back-EMF and torque go with it."""
    driven: bool = True
    """False: the windings carry a set current (0 = coasting) instead of a voltage."""
    n: float = 0.0
    """rev/s, signed."""
    acceleration: float = 0.0
    """rev/s^2, of a concealed rotor inertia; a rotor of the thruster table keeps its own account."""
    thrust: float = 0.0
    """N, of the propeller, positive forward."""
    force: float = 0.0
    """N, on the load cell: thrust through the stand."""
    hung: float = 0.0
    """N, of dead weights that hang on the stand, positive forward."""
    reading: float = 0.0
    """N, what the cell would read without noise and clipping."""
    torque: float = 0.0
    """N.m, of the propeller."""
    current: float = 0.0
    """A in the motor, positive when it drives in the direction of the voltage."""
    input_current: float = 0.0
    """A from the supply."""
    bus_voltage: float = 48.0
    """V."""
    flow: float = 0.0
    """m/s of the tunnel."""
    water_temperature: float = 18.0
    """degC."""
    motor_rise: float = 0.0
    """K, winding over water."""
    # constants of the mounted thruster, the supply and the stand, here so that effects need no second argument
    series_loss: float = 0.0
    """1/V, of V = e + loss e^2 between the terminals and the cold motor's back-EMF e; 0 where the drive makes up."""
    rate_per_volt: float = 1.0
    thrust_constant: float = 0.4
    """C_t = C / k^2, N/(rev/s)^2."""
    drag: float = 0.25
    torque_acceleration: float = 7.2
    nominal_bus: float = 48.0
    stand_frequency: float = 0.0
    """Hz of a stand that rings; 0: rigid."""
    stand_damping: float = 0.0
    zero: float = 0.0
    """N that the cell reads with no load."""
