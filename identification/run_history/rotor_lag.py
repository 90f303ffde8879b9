"""A rotor that follows what it is asked for, n' = quadratic (w|w| - n|n|) + linear (w - n), exactly while w is held.

Where w is 0 a drive may open its windings: of the linear brake the share `released` is missing there.

Its equation is Riccati's on either side of rest. Beyond rest, u = n - w of w >= 0 is logistic, u' = -rate u -
quadratic u^2 with rate = 2 quadratic w + linear; a rotor that turns against w comes to rest first, by a tangent. So a
hold of seconds is one step, as an interval of milliseconds is: a slope at the middle of its ends would be far off.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from identification.recording import Floats
from identification.run_history.filters import lowpass, recursion
from identification.run_history.held import Held

LAG_STEPS = 12
LAG_CLOSE = 1e-5
"""Relative change of the rate after which the quadratic lag has converged: what is left is about its square."""
LEAST = 1e-9
"""Of what is divided by: below it a quotient is its limit."""
NOTHING = 1e-200
"""Of a rotor that is asked to turn the other way by the rounding of 0: it coasts."""
BARELY = 1e-7
"""Of the linear brake: a quadratic one that is smaller is none."""


AT_REST = 1e-6
"""Unit of w: a mean over an interval in which it is 0 differs from that by the rounding of its edges."""


class Rotor(NamedTuple):
    """Coefficients of the equation above."""

    quadratic: float
    """1/(s unit of w)."""
    linear: float
    """1/s."""
    released: float = 0.0
    """Share of the linear brake that is missing while w is 0."""

    def linear_at(self, w: Floats) -> Floats | float:
        """1/s, while w is held."""
        if self.released == 0:
            return self.linear
        return np.where(np.abs(w) < AT_REST, self.linear * (1 - self.released), self.linear)


def lag(w: Floats, dt: Floats, rotor: Rotor, start: float = 0.0, near: Floats | None = None) -> tuple[Floats, Floats]:
    """Rates at the ends of intervals of length `dt`, in each of which w (M,) is held, and their means.

    `near`: ends of a lag that is not far off.
    """
    if rotor.quadratic == 0 and rotor.released == 0:
        return lowpass(w, dt, 1 / rotor.linear, start)
    hold = _hold(w, dt, rotor)
    end = _lag_ends(hold, rotor, start, near)
    return end, _turned(hold, np.concatenate([[start], end[:-1]]), rotor) / dt


def lag_means(
    w: Floats,
    dt: Floats,
    rotor: Rotor,
    start: float = 0.0,
    near: Floats | None = None,
    held: Held | None = None,
) -> Floats:
    """The means of `lag`. `held`: pieces in which w stands still, if it does: each is one step of the recursion."""
    if rotor.quadratic == 0 or held is None or not held.holds(w):
        return lag(w, dt, rotor, start, near)[1]
    pieces = _hold(w[held.first], held.time, rotor)
    end = _lag_ends(pieces, rotor, start, None if near is None else near[held.last])
    before = np.concatenate([[start], end[:-1]])[held.which]
    turned = _turned(_hold(w, held.since, rotor), before, rotor)
    return held.beside_before(turned) / dt


def lag_ends(w: Floats, dt: Floats, rotor: Rotor, start: float = 0.0, near: Floats | None = None) -> Floats:
    """The same rates at the ends alone: all at once by Newton's method, each step of it one linear recursion."""
    if rotor.quadratic == 0:
        keep = np.exp(-rotor.linear_at(w) * dt)
        return recursion(keep, (1 - keep) * w, start)
    return _lag_ends(_hold(w, dt, rotor), rotor, start, near)


def lagged(w: Floats, before: Floats, since: Floats, rotor: Rotor) -> Floats:
    """Rate `since` s after it was `before`, w held since then; (k,)."""
    if rotor.quadratic == 0:
        return np.asarray(w + (before - w) * np.exp(-rotor.linear_at(w) * since), dtype=np.float64)
    return _ends(_hold(w, since, rotor), before, rotor).end


def _lag_ends(hold: _Hold, rotor: Rotor, start: float, near: Floats | None) -> Floats:
    w = hold.w
    size = float(np.max(np.abs(w), initial=abs(start))) or 1.0
    end = w if near is None else near
    before = np.empty_like(w)
    before[0] = start
    for _ in range(LAG_STEPS):
        before[1:] = end[:-1]
        found = _ends(hold, before, rotor)
        move = recursion(found.slope, found.end - end, 0.0)
        end = np.clip(end + move, -size, size)
        if float(np.max(np.abs(move))) < LAG_CLOSE * size:
            break
    return end


def follow_rate(w: Floats, n: Floats, rotor: Rotor) -> Floats:
    """Rate of following at n, 1/s: of n' = rate (w - n)."""
    product = w * n
    both = np.abs(n) + np.abs(w)
    both += 2 * np.minimum(product, 0.0) / np.maximum(both, 1e-300)
    out: Floats = rotor.quadratic * both + rotor.linear_at(w)
    return out


def to_rest(w: Floats, n: Floats, rotor: Rotor) -> Floats:
    """(k,) s until a rotor at n, which turns against w, comes to rest."""
    quadratic, linear, _ = rotor
    size, against = np.abs(w), np.abs(n)
    beyond = against / np.maximum(quadratic * size**2 + linear * (size + 0.5 * against), NOTHING)
    swing = quadratic * (quadratic * size**2 + linear * size) - 0.25 * linear**2
    turn = np.sqrt(np.abs(swing))
    reach = turn * beyond
    angle = _either(swing, np.arctan, lambda x: np.arctanh(np.minimum(x, 1 - 1e-15)), reach)
    return np.where(reach > LEAST, angle / np.maximum(turn, 1e-300), beyond)


def _either(
    swing: Floats, circular: Callable[[Floats], Floats], hyperbolic: Callable[[Floats], Floats], at: Floats
) -> Floats:
    """What solves the equation of one that swings through rest, or of one that its linear brake alone would stop."""
    swings = swing > 0
    if swings.all():
        return circular(at)
    out: Floats = np.where(swings, circular(at), hyperbolic(at)) if swings.any() else hyperbolic(at)
    return out


class _Hold(NamedTuple):
    """What of a time in which w is held does not depend on how fast the rotor turned before; (M,) each."""

    w: Floats
    t: Floats
    rest: NDArray[np.intp]
    """(k,) where it is asked to stand."""
    sign: Floats
    aim: Floats
    rate: Floats
    """1/s, of the linear part."""
    kept: Floats
    """Of a gap to w, by the linear part."""
    time: Floats
    """s that a gap would have to last for its integral, by the linear part."""


class _Ends(NamedTuple):
    """Of such times, and of the rates before them; (M,) each."""

    end: Floats
    slope: Floats
    """Of the end over the beginning."""


class _Onwards(NamedTuple):
    """What is left of a time when the rotor turns as it is asked, or stands, or is asked to stand; (M,) each."""

    sign: Floats
    gap: Floats
    """By size, from w."""
    kept: Floats
    time: Floats
    bend: Floats


def _hold(w: Floats, t: Floats, rotor: Rotor) -> _Hold:
    if rotor.released:
        w = np.where(np.abs(w) < AT_REST, 0.0, w)
    aim = np.abs(w)
    rate = 2 * rotor.quadratic * aim
    rate += rotor.linear_at(w)
    return _Hold(w, t, np.flatnonzero(aim == 0), np.where(w < 0, -1.0, 1.0), aim, rate, *_kept(rate, t))


def _kept(rate: Floats, t: Floats) -> tuple[Floats, Floats]:
    share = rate * t
    lost = -np.expm1(-share)
    return 1 - lost, np.where(share > LEAST, lost / np.maximum(rate, 1e-300), t)


def _ends(hold: _Hold, before: Floats, rotor: Rotor) -> _Ends:
    quadratic, linear, _ = rotor
    against = np.flatnonzero(hold.w * before < 0)
    if not against.size:
        return _end(hold, _onwards(hold, before, quadratic))
    w, then = hold.w[against], before[against]
    braked = _braked(w, then, hold.t[against], rotor)
    found = _end(hold, _beyond_rest(hold, before, against, braked, quadratic))
    pull, now = (quadratic * (w * np.abs(w) - n * np.abs(n)) + linear * (w - n) for n in (then, found.end[against]))
    found.slope[against] = now / pull
    return found


def _turned(hold: _Hold, before: Floats, rotor: Rotor) -> Floats:
    """(M,) integral of the rate."""
    quadratic = rotor.quadratic
    against = np.flatnonzero(hold.w * before < 0)
    if not against.size:
        return _integral(hold, _onwards(hold, before, quadratic), hold.t)
    w, then, left = hold.w[against], before[against], hold.t.copy()
    braked = _braked(w, then, left[against], rotor)
    left[against] -= braked.spent
    turned = _integral(hold, _beyond_rest(hold, before, against, braked, quadratic), left)
    turned[against] += _turned_against(w, then, braked, rotor)
    return turned


def _onwards(hold: _Hold, before: Floats, quadratic: float) -> _Onwards:
    sign = hold.sign
    if hold.rest.size:
        sign = sign.copy()
        sign[hold.rest] = np.where(before[hold.rest] < 0, -1.0, 1.0)
    gap = before * sign
    gap -= hold.aim
    bend = quadratic * gap
    bend *= hold.time
    return _Onwards(sign, gap, hold.kept, hold.time, bend)


def _beyond_rest(hold: _Hold, before: Floats, against: NDArray[np.intp], braked: _Braked, quadratic: float) -> _Onwards:
    """Where some were `braked` first, at the rows `against`."""
    begin, kept, time = before.copy(), hold.kept.copy(), hold.time.copy()
    begin[against] = braked.end
    kept[against], time[against] = _kept(hold.rate[against], hold.t[against] - braked.spent)
    return _onwards(hold._replace(kept=kept, time=time), begin, quadratic)


def _end(hold: _Hold, left: _Onwards) -> _Ends:
    beside = 1 / (1 + left.bend)
    slope = left.kept * beside
    end = left.gap * slope
    end += hold.aim
    end *= left.sign
    slope *= beside
    return _Ends(end, slope)


def _integral(hold: _Hold, left: _Onwards, t: Floats) -> Floats:
    near = np.abs(left.bend) < LEAST
    turned = left.gap * left.time
    turned *= np.where(near, 1.0, np.log1p(left.bend) / np.where(near, 1.0, left.bend))
    turned += hold.aim * t
    turned *= left.sign
    return turned


class _Braked(NamedTuple):
    """Of rotors that turn against what they are asked, as far as rest; (k,) each."""

    end: Floats
    spent: Floats
    """s, of the time that there was."""
    shrink: Floats
    angle: Floats
    swing: Floats


def _braked(w: Floats, before: Floats, t: Floats, rotor: Rotor) -> _Braked:
    """By size m against w: m' = -(quadratic m^2 + linear m + pull)."""
    quadratic, linear, _ = rotor
    aim, size = np.abs(w), np.abs(before)
    pull = quadratic * aim**2 + linear * aim
    rest = to_rest(w, before, rotor)
    spent = np.minimum(t, rest)
    swing = quadratic * pull - 0.25 * linear**2
    turn = np.sqrt(np.abs(swing))
    angle = turn * spent
    small = angle < LEAST
    tangent = _either(swing, np.tan, np.tanh, angle)
    time = np.where(small, spent, tangent / np.where(small, 1.0, turn))
    shrink = 1 + (quadratic * size + 0.5 * linear) * time
    end = np.maximum((size * (1 - 0.5 * linear * time) - pull * time) / shrink, 0.0)
    end = np.where(t < rest, end, 0.0)
    return _Braked(np.sign(before) * end, spent, shrink, angle, swing)


def _turned_against(w: Floats, before: Floats, braked: _Braked, rotor: Rotor) -> Floats:
    """(k,) integral of the rate as far as rest."""
    quadratic, linear, _ = rotor
    aim, size, spent = np.abs(w), np.abs(before), braked.spent
    if quadratic * float(np.max(size)) < BARELY * linear:  # the logarithm would be one of 1
        turned = (size + aim) * -np.expm1(-linear * spent) / linear - aim * spent
    else:
        cosine = _either(braked.swing, np.cos, lambda x: np.cosh(np.minimum(x, 700.0)), braked.angle)
        turned = (np.log(cosine * braked.shrink) - 0.5 * linear * spent) / quadratic
    return np.sign(before) * turned
