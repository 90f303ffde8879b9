"""HoloOcean, whose agents take forces: a Python module that makes them of the input, with the lag.

Source: HoloOcean 2.3.0, agents BlueROV2 (eight forces in N, each clipped at BR_MAX_THRUST = 10 * 11.5 / 4 = 28.75 N).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rig.exporting.twins.curve import Floats
from rig.exporting.twins.written import CHECK_AT, Asked, Carried, hashed, head, put

CLIP = 28.75
"""N"""


def carried(asked: Asked) -> Carried:
    curve = asked.curve
    most = float(np.max(np.abs(curve.thrust)))
    lost = (f"forces beyond {CLIP:g} N: the agent clips them, and this thruster gives {most:.3g} N",)

    def thrust(u: Floats) -> Floats:
        out: Floats = np.clip(curve.at(u), -CLIP, CLIP)
        return out

    return Carried(thrust, lag=True, lost=lost if most > CLIP else ())


BODY = '''import math
import warnings
from bisect import bisect_left

INPUT = {driver}  # {unit}
THRUST = {thrust}  # N
TIME_CONSTANT = {lag!r}  # s
CLIP = {clip!r}  # N, by the agent


class Thruster:
    """Call it once a step with the input in {unit} and the step in s: the force in N for the agent's command."""

    def __init__(self):
        self.lagging = 0.0

    def __call__(self, value, dt):
        share = 1.0 - math.exp(-dt / TIME_CONSTANT) if TIME_CONSTANT else 1.0
        self.lagging += share * (value - self.lagging)
        force = steady(self.lagging)
        if abs(force) > CLIP:
            warnings.warn(f"{{force:.1f}} N: the agent clips at {{CLIP}} N", stacklevel=2)
        return max(-CLIP, min(CLIP, force))


def steady(value):
    """N"""
    if value <= INPUT[0] or value >= INPUT[-1]:
        return THRUST[0] if value <= INPUT[0] else THRUST[-1]
    i = bisect_left(INPUT, value)
    share = (value - INPUT[i - 1]) / (INPUT[i] - INPUT[i - 1])
    return THRUST[i - 1] + share * (THRUST[i] - THRUST[i - 1])


if __name__ == "__main__":
    error = steady({at!r}) - {wanted!r}
    print("self-check", "passed" if abs(error) < 1e-6 else f"FAILED by {{error}} N")
'''


def write(asked: Asked, path: Path) -> None:
    curve = asked.curve
    at = CHECK_AT * curve.largest
    body = BODY.format(
        driver=_list(curve.driver), thrust=_list(curve.thrust), unit=curve.unit, lag=curve.lag, clip=CLIP, at=at,
        wanted=float(curve.at(np.array([at]))[0]),
    )  # fmt: skip
    put(path, [*hashed(head(asked, carried(asked))), body.rstrip()])


def _list(values: Floats) -> str:
    return "[" + ", ".join(repr(float(value)) for value in values) + "]"
