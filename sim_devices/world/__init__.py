"""Water, thruster, stand and sensors, in SI. No wires, files or clocks: time is an argument."""

from sim_devices.world.settings import WorldSettings, read_world
from sim_devices.world.world import World

__all__ = ["World", "WorldSettings", "read_world"]
