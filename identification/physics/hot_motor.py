"""Balance of a motor fed with a voltage, cold and hot.

    V = k_e (1 - m) n + R (1 + c) i,    i = k_q n^2 / (k_t (1 - m))

m is the share of flux that hot magnets have lost (0.001 to 0.0012 1/K of NdFeB), c the share by which hot copper
resists more (0.0039 1/K); Pyrhonen, Jokinen and Hrabovcova (2008), *Design of Rotating Electrical Machines*, Wiley. In
units of the driver, e = k_e n of the cold motor and w = R k_q / (k_t k_e^2):

    (1 - m) y + w (1 + c) y^2 / (1 - m) = e + w e^2

e is the rate of the cold motor, y that of the hot one at the same voltage. Copper costs more the higher the level.
Weaker magnets let it turn *faster* where less than half of the voltage is lost in the winding, by about the same share
at all levels, and slower beyond.
"""

from __future__ import annotations

import numpy as np

from identification.recording import Floats

TYPICAL_LOSS = 0.15
"""Of the largest driver in the cold winding, where no model says it: half-way between the 5 and 35 % of the field
(logarithmically). How the loss by hot copper grows with the level depends on it."""


def cold_motor(known: float | None, driver: float, share: float = TYPICAL_LOSS) -> tuple[float, float]:
    """W in 1/(unit of the driver) by the model, or that which takes `share` of the largest `driver`; and the cold rate
    there.

    Where the model says nothing of the winding, rates are in units of what the cold motor makes of the command.
    """
    if known is None:
        return share / ((1 - share) * driver), driver
    return known, float(2 * driver / (1 + np.sqrt(1 + 4 * known * driver)))


def hot_rate(cold: Floats, winding: float, copper: Floats | float, flux: Floats | float) -> Floats:
    """Y of a motor that would turn at `cold` (M,): `copper` is w c, 1/(unit of the driver); `flux` is m.

    At 20 % of the voltage lost and 40 K, and magnets 20 K up (shares by which thrust, y^2, rises):

    >>> cold, w = np.array([0.8, 0.0970563]), 0.3125  # at 1 V and 0.1 V
    >>> np.round(100 * ((hot_rate(cold, w, 0.0039 * 40 * w, 0.0) / cold) ** 2 - 1), 1).tolist()
    [-4.9, -0.9]
    >>> np.round(100 * ((hot_rate(cold, w, 0.0, 0.0011 * 20) / cold) ** 2 - 1), 1).tolist()
    [2.2, 4.1]
    """
    size = np.abs(cold)
    left = 1 - np.asarray(flux)
    voltage = voltage_of(size, winding)
    # (1 - m) y = u: u + lost u^2 = V
    lost = (winding + copper) / left**3
    u = 2 * voltage / (1 + np.sqrt(np.maximum(1 + 4 * lost * voltage, 0.0)))
    out: Floats = np.copysign(u / left, cold)
    return out


def hot_equation(name: str, winding: float, copper: str, flux: str, comment: str = "") -> tuple[str, ...]:
    """`hot_rate` of a variable, to be typed in; `copper` and `flux` as expressions, empty where there is none."""
    left = " / (1 - weaker)" if flux else ""
    weaker = (f"weaker = {flux}",) if flux else ()
    if not (winding or copper):
        return *weaker, f"{name} = {name}{left}"
    lost = " + ".join([f"{winding:.6g}", *filter(None, (copper,))])
    lost = f"({lost}){left} ** 3" if flux else lost
    return (
        *weaker,
        f"voltage = abs({name}) + {winding:.6g} * {name} ** 2{comment}",
        f"lost = {lost}",
        f"{name} = sign({name}) * 2 * voltage / (1 + sqrt(1 + 4 * lost * voltage)){left}",
    )


def voltage_of(size: Floats, winding: float) -> Floats:
    """|V| that a cold motor needs to turn at `size`."""
    out: Floats = size + winding * size**2
    return out


def copper_at_full(loss: float, winding: float, cold: float) -> float:
    """W c of which thrust falls by the share `loss` where the cold motor turns at `cold`.

    >>> w = 0.3125
    >>> round(float(hot_rate(np.array([0.8]), w, copper_at_full(0.1, w, 0.8), 0.0)[0]) ** 2 / 0.64, 9)
    0.9
    """
    hot = np.sqrt(1 - loss) * cold
    return float((cold - hot + winding * (cold**2 - hot**2)) / hot**2)


def weaker_at_full(winding: float, cold: float) -> float:
    """W c for each small share of the thrust that is lost where the cold motor turns at `cold`."""
    return (1 + 2 * winding * cold) / (2 * cold)
