"""A rotor that follows what it is asked for, n' = quadratic (w|w| - n|n|) + linear (w - n), exactly while w is held.

Its equation is Riccati's on either side of rest. Beyond rest, u = n - w of w >= 0 is logistic, u' = -rate u -
quadratic u^2 with rate = 2 quadratic w + linear; a rotor that turns against w comes to rest first, by a tangent. So a
hold of seconds is one step, as an interval of milliseconds is: a slope at the middle of its ends would be far off.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from identification.recording import Floats
from identification.run_history.filters import lowpass, recursion

LAG_STEPS = 12
LAG_CLOSE = 1e-5
"""Relative change of the rate after which the quadratic lag has converged: what is left is about its square."""
LEAST = 1e-9
"""Of what is divided by: below it a quotient is its limit."""
NOTHING = 1e-200
"""Of a rotor that is asked to turn the other way by the rounding of 0: it coasts."""
BARELY = 1e-7
"""Of the linear brake: a quadratic one that is smaller is none."""


def lag(
    w: Floats, dt: Floats, quadratic: float, linear: float, start: float = 0.0, near: Floats | None = None
) -> tuple[Floats, Floats]:
    """Rates at the ends of intervals of length `dt`, in each of which w (M,) is held, and their means.

    `near`: ends of a lag that is not far off.
    """
    if quadratic == 0:
        return lowpass(w, dt, 1 / linear, start)
    end = lag_ends(w, dt, quadratic, linear, start, near)
    return end, _followed(w, np.concatenate([[start], end[:-1]]), dt, quadratic, linear).turned / dt


def lag_ends(
    w: Floats, dt: Floats, quadratic: float, linear: float, start: float = 0.0, near: Floats | None = None
) -> Floats:
    """The same rates at the ends alone: all at once by Newton's method, each step of it one linear recursion."""
    if quadratic == 0:
        keep = np.exp(-linear * dt)
        return recursion(keep, (1 - keep) * w, start)
    size = float(np.max(np.abs(w), initial=abs(start))) or 1.0
    end = w if near is None else near
    before = np.empty_like(w)
    before[0] = start
    for _ in range(LAG_STEPS):
        before[1:] = end[:-1]
        found = _followed(w, before, dt, quadratic, linear)
        move = recursion(found.slope, found.end - end, 0.0)
        end = np.clip(end + move, -size, size)
        if float(np.max(np.abs(move))) < LAG_CLOSE * size:
            break
    return end


def lagged(w: Floats, before: Floats, since: Floats, quadratic: float, linear: float) -> Floats:
    """Rate `since` s after it was `before`, w held since then; any one shape."""
    return _followed(w, before, since, quadratic, linear).end


def follow_rate(w: Floats, n: Floats, quadratic: float, linear: float) -> Floats:
    """Rate of following at n, 1/s: of n' = rate (w - n)."""
    product = w * n
    both = np.abs(n) + np.abs(w)
    both += 2 * np.minimum(product, 0.0) / np.maximum(both, 1e-300)
    out: Floats = quadratic * both + linear
    return out


def to_rest(w: Floats, n: Floats, quadratic: float, linear: float) -> Floats:
    """(k,) s until a rotor at n, which turns against w, comes to rest."""
    size, against = np.abs(w), np.abs(n)
    beyond = against / np.maximum(quadratic * size**2 + linear * (size + 0.5 * against), NOTHING)
    swing = quadratic * (quadratic * size**2 + linear * size) - 0.25 * linear**2
    turn = np.sqrt(np.abs(swing))
    reach = turn * beyond
    angle = np.where(swing > 0, np.arctan(reach), np.arctanh(np.minimum(reach, 1 - 1e-15)))
    return np.where(reach > LEAST, angle / np.maximum(turn, 1e-300), beyond)


class _Followed(NamedTuple):
    """Of a time in which w is held, (M,) each."""

    end: Floats
    slope: Floats
    """Of the end over the beginning."""
    turned: Floats
    """Integral of the rate."""


def _followed(w: Floats, before: Floats, t: Floats, quadratic: float, linear: float) -> _Followed:
    against = np.flatnonzero(w * before < 0)
    if not against.size:
        return _onwards(w, before, t, quadratic, linear)
    begin, left = before.copy(), np.array(t, dtype=np.float64)
    first = _against(w[against], before[against], left[against], quadratic, linear)
    begin[against], left[against] = first.end, left[against] - first.spent
    then = _onwards(w, begin, left, quadratic, linear)
    then.turned[against] += first.turned
    pull = quadratic * (w * np.abs(w) - before * np.abs(before)) + linear * (w - before)
    now = quadratic * (w * np.abs(w) - then.end * np.abs(then.end)) + linear * (w - then.end)
    then.slope[against] = now[against] / pull[against]
    return then


def _onwards(w: Floats, before: Floats, t: Floats, quadratic: float, linear: float) -> _Followed:
    """Of rotors that turn as they are asked, or stand, or are asked to stand."""
    sign = np.where(w < 0, -1.0, 1.0)
    sign[(w == 0) & (before < 0)] = -1.0
    aim, gap = np.abs(w), before * sign
    gap -= aim
    rate = 2 * quadratic * aim
    rate += linear
    share = rate * t
    lost = -np.expm1(-share)
    kept = 1 - lost
    time = np.where(share > LEAST, lost / np.maximum(rate, 1e-300), t)
    bend = quadratic * gap * time
    beside = 1 / (1 + bend)
    left = gap * kept * beside
    near = np.abs(bend) < LEAST
    turned = gap * time * np.where(near, 1.0, np.log1p(bend) / np.where(near, 1.0, bend))
    turned += aim * t
    return _Followed(sign * (aim + left), kept * beside**2, sign * turned)


class _Braked(NamedTuple):
    """Of rotors that turn against what they are asked, as far as rest."""

    end: Floats
    spent: Floats
    """s, of the time that there was."""
    turned: Floats


def _against(w: Floats, before: Floats, t: Floats, quadratic: float, linear: float) -> _Braked:
    """By size m against w: m' = -(quadratic m^2 + linear m + pull)."""
    sign, aim, size = np.sign(before), np.abs(w), np.abs(before)
    pull = quadratic * aim**2 + linear * aim
    rest = to_rest(w, before, quadratic, linear)
    spent = np.minimum(t, rest)
    swing = quadratic * pull - 0.25 * linear**2
    turn = np.sqrt(np.abs(swing))
    angle = turn * spent
    small = angle < LEAST
    tangent = np.where(swing > 0, np.tan(angle), np.tanh(angle))
    time = np.where(small, spent, tangent / np.where(small, 1.0, turn))
    shrink = 1 + (quadratic * size + 0.5 * linear) * time
    end = np.maximum((size * (1 - 0.5 * linear * time) - pull * time) / shrink, 0.0)
    end = np.where(t < rest, end, 0.0)
    if quadratic * float(np.max(size)) < BARELY * linear:  # the logarithm would be one of 1
        turned = (size + aim) * -np.expm1(-linear * spent) / linear - aim * spent
    else:
        cosine = np.where(swing > 0, np.cos(angle), np.cosh(np.minimum(angle, 700.0)))
        turned = (np.log(cosine * shrink) - 0.5 * linear * spent) / quadratic
    return _Braked(sign * end, spent, sign * turned)
