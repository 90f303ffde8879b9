"""The effects a world can conceal, one small class each, by their catalogue id.

An effect has a `stage` and changes one number there: `command` (V at the motor's
terminals), `motor` (V that the rotor answers to), `rotor` (rotation rate),
`hydro` (propeller thrust), `stand` (force that reaches the cell), `cell` (reading), `output` (after noise and offset).
An effect that is not named in the world file is not there at all: its stage holds no object for it.
"""

from sim_devices.world.effects.blade import Asymmetry, Cavitation, Exponent, LinearTerm, ReversalLoss
from sim_devices.world.effects.cell import (
    LoadCellCreep,
    LoadCellEvenBend,
    LoadCellNonlinearity,
    ZeroDrift,
    ZeroOffset,
)
from sim_devices.world.effects.channel import ChannelFault
from sim_devices.world.effects.electrical import DeadBand, SupplySag
from sim_devices.world.effects.flow import InflowDynamics, Recirculation, SpeedOfAdvance, ThrusterInteraction
from sim_devices.world.effects.limit import CommandSaturation, LoadCellSaturation
from sim_devices.world.effects.line import PeriodicDisturbance
from sim_devices.world.effects.motor import Heating, WindingResistance
from sim_devices.world.effects.rotor import MotorLag, RotationCoupling
from sim_devices.world.effects.stage import Effect
from sim_devices.world.effects.stand import Hysteresis, StandResonance, StrutDrag, TimeSkew, TorqueCrosstalk

# In the order in which they act within their stage.
EFFECTS: dict[str, type[Effect]] = {
    "command_saturation": CommandSaturation,
    "supply_sag": SupplySag,
    "dead_band": DeadBand,
    "winding_resistance": WindingResistance,
    "motor_lag": MotorLag,
    "rotation_coupling": RotationCoupling,
    "exponent": Exponent,
    "asymmetry": Asymmetry,
    "inflow_dynamics": InflowDynamics,
    "cavitation": Cavitation,
    "heating": Heating,
    "reversal_loss": ReversalLoss,
    "linear_term": LinearTerm,
    "speed_of_advance": SpeedOfAdvance,
    "recirculation": Recirculation,
    "thruster_interaction": ThrusterInteraction,
    "strut_drag": StrutDrag,
    "torque_crosstalk": TorqueCrosstalk,
    "stand_resonance": StandResonance,
    "hysteresis": Hysteresis,
    "time_skew": TimeSkew,
    "load_cell_creep": LoadCellCreep,
    "load_cell_nonlinearity": LoadCellNonlinearity,
    "load_cell_even_bend": LoadCellEvenBend,
    "periodic_disturbance": PeriodicDisturbance,
    "zero_drift": ZeroDrift,
    "zero_offset": ZeroOffset,
    "load_cell_saturation": LoadCellSaturation,
    "channel_fault": ChannelFault,
}

__all__ = ["EFFECTS", "Effect"]
