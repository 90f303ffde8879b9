"""Runs laid directly on uneven intervals, with every channel that a term may look at."""

import numpy as np

from identification.physics.term import Scale, TermContext
from identification.run_history.history import History
from identification.run_history.remembered import RememberedRun


def uneven(rng, n, low=0.004, high=0.25):
    """(n,) s, lengths of intervals spread over the decades."""
    return np.exp(rng.uniform(np.log(low), np.log(high), n))


def history(n=400, volts=1.0, newtons=1.0, seed=1, flow=1.0):
    """Levels of both signs with rests, ramps between some of them; everything recorded. Sizes times `volts` etc."""
    rng = np.random.default_rng(seed)
    dt = uneven(rng, n, high=6.0)  # some minutes: slow effects are looked for too
    levels = np.repeat(rng.choice((-12.0, -9.0, -5.0, -1.0, 0.0, 2.0, 6.0, 8.0, 12.0), n // 8), 8)
    levels[1::16] *= 0.5  # some levels are reached in two steps
    driver = volts * np.concatenate([levels, np.zeros(n - levels.size)])
    edges = np.concatenate([[0.0], np.cumsum(dt)])
    C = 0.5 * newtons / volts**2
    reading = C * driver * np.abs(driver) + newtons * rng.standard_normal(n)
    rate = 2.0 * driver / volts
    others = {
        "rotation_rate": rate * (1 + 0.1 * np.sin(edges[1:])),
        "bus_voltage": volts * (30.0 - 0.02 * np.abs(levels_squared(driver / volts))),
        "flow_speed": flow * np.where(np.sin(0.3 * edges[1:]) > 0, 0.7, -0.2),
        "motor_temperature": 20.0 + 15.0 * (1 - np.exp(-edges[1:] / 60.0)),
        "torque": newtons * np.where(driver > 0, 3.0, -2.6) * levels_squared(driver / volts) / 144.0,
        "neighbour_thrust": newtons * 40.0 * (np.sin(0.5 * edges[1:]) > 0),
    }
    return History(
        recording_id="made",
        driver_quantity="command_voltage",
        edges=edges,
        driver=driver,
        thrust=reading,
        count=np.full(n, 2),
        sampled=0.5 * (edges[1:] + edges[:-1]),
        within=np.zeros(n),
        rate=others["rotation_rate"],
        rate_count=np.full(n, 2),
        rate_sampled=0.5 * (edges[1:] + edges[:-1]),
        others=others,
        rate_per_driver=2.0 / volts,
        spacing=0.002,
    )


def levels_squared(x):
    return x * x


def scale(h, volts=1.0, newtons=1.0, noise=1.0, flow=1.0):
    return Scale(
        driver=12.0 * volts,
        driver_unit="V",
        thrust=72.0 * newtons,
        duration=float(h.edges[-1]),
        interval=0.004,
        flow=0.7 * flow,
        reading=75.0 * newtons,
        noise=noise * newtons,
        torque=3.0 * newtons,
    )


def moment(h, s, tare=0.0, x=None):
    return TermContext(RememberedRun(h), s, s.thrust / s.driver**2, tare, h.driver if x is None else x)
