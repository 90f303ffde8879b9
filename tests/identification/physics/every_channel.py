"""A run of steps, ramps and reversals on short even intervals, with every channel that a term may look at."""

from dataclasses import replace

import numpy as np

from identification.physics.term import KELVIN, Scale
from identification.run_history.history import History

DT = 0.005
RATE = 2.0
"""rev/s per volt."""
C = 0.5
TURNS = ((0.0, 0.0), (0.5, 0.0), (0.5, 6.0), (2.0, 6.0), (2.0, 12.0), (3.5, 12.0), (6.0, -12.0), (7.0, -12.0))
TURNS += ((7.0, 8.0), (8.5, 8.0), (8.5, -9.0), (10.0, -9.0), (10.0, 0.0), (11.0, 0.0), (12.0, 2.0), (13.0, 2.0))
TURNS += ((13.0, -1.0), (14.0, -1.0), (14.0, -5.0), (16.0, 11.0), (18.0, 11.0), (18.0, 0.0), (20.0, 0.0))
"""(s, V)."""
EDGES = DT * np.arange(round(TURNS[-1][0] / DT) + 1)
T = 0.5 * (EDGES[1:] + EDGES[:-1])
V = np.interp(T, *np.array(TURNS).T)
OTHERS = {
    "rotation_rate": RATE * V * (1 + 0.1 * np.sin(T)),
    "bus_voltage": 30.0 - 0.02 * V**2 + 0.5 * np.sin(0.7 * T),
    "flow_speed": 0.7 * np.sin(0.9 * T),
    "motor_temperature": 21.0 + 15.0 * (1 - np.exp(-T / 8.0)),
    "torque": np.where(V > 0, 3.0, -2.6) * V**2 / 144.0,
    "neighbour_thrust": 40.0 * np.sin(0.5 * T),
    "current": 0.05 * V**2 + 0.3,
    "water_temperature": 14.0 + 0.1 * T,
}
RUN = History(
    recording_id="made",
    driver_quantity="command_voltage",
    edges=EDGES,
    driver=V,
    thrust=C * V * np.abs(V),
    count=np.full(T.size, 2),
    sampled=T,
    within=np.zeros(T.size),
    rate=OTHERS["rotation_rate"],
    rate_count=np.full(T.size, 2),
    rate_sampled=T,
    others=OTHERS,
    rate_per_driver=RATE,
    spacing=DT,
)
SCALE = Scale(
    driver=12.0,
    driver_unit="V",
    thrust=C * 144.0,
    duration=20.0,
    interval=DT,
    flow=0.7,
    reading=75.0,
    torque=3.0,
    spacing=DT,
    bus=30.4,
    current=7.1,
    neighbour=41.0,
    cold=KELVIN + 20.5,
)
UNREFERRED = replace(SCALE, bus=0.0, current=0.0, neighbour=0.0, cold=0.0)
"""Of a twin that does not say what its runs had at most."""


def with_only(quantities):
    """The run with no other channels."""
    return replace(RUN, others={name: OTHERS[name] for name in quantities})
