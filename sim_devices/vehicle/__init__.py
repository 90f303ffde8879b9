"""A ROMEO-like vehicle in water: thrusters on a hull, trials, and what its sensors gave. No files, wires or clocks."""

from sim_devices.vehicle.body import Body, Hull, Mounted
from sim_devices.vehicle.romeo import romeo
from sim_devices.vehicle.trials import Trial, run_trials

__all__ = ["Body", "Hull", "Mounted", "Trial", "romeo", "run_trials"]
