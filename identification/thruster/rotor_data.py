"""Rotation rate and voltage of a recording cut into pieces that a rotor model is simulated over, all at once.

Only the driven parts are used: at zero volts a rig releases the rotor, which then coasts by other laws. Each piece
starts from the measured rate some time before its first sample counts, so that an error of the start is forgotten.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.recording import Channel, Floats, Recording
from identification.steady_state.holds import from_voltage
from identification.thruster.thrust_data import Unusable

PIECE = 1.0
"""s of samples that count."""
WARM_UP = 1.0
"""s simulated before them; several time constants of a thruster (0.05 to 0.3 s)."""
RELEASED = 0.1
"""s at zero volts from which on the rotor counts as released."""
START = 0.1
"""s over which the measured rate is averaged for a start at rest; a quarter of it, either side, within a run."""
STEP = 0.01
"""s of the simulation: a fifth of the fastest time constant of interest."""
FEWEST = 50
"""Samples of a driven rotor below which there is no dynamics to see."""
SIDED = 0.1
"""Share of the largest voltage that must be commanded backwards before a rate is asked for its sign."""


@dataclass(frozen=True, eq=False)
class Drive:
    """One recording: the input as running integrals, and the pieces. All times in s of the recording."""

    edges: Floats
    """(e,) where the integrals bend."""
    square: Floats
    """(e,) integral of V|V|, V^2 s."""
    plain: Floats
    """(e,) integral of V, V s."""
    starts: Floats
    """(c,) where each piece's simulation starts."""
    first: Floats
    """(c,) rev/s measured there."""
    time: Floats
    """(n,) of the samples that count, piece by piece."""
    rate: Floats
    """(n,) rev/s."""
    piece: np.ndarray[tuple[int], np.dtype[np.intp]]
    """(n,) which piece each belongs to, from 0."""
    holds: tuple[tuple[float, float, float], ...]
    """(V, from, to) of constant voltage while driven."""

    def mean_input(self, steps: int, delay: float) -> tuple[Floats, Floats]:
        """Mean V|V| and V (c, steps) over the steps of every piece, the input coming `delay` s late."""
        at = self.starts[:, None] + STEP * np.arange(steps + 1) - delay
        square = np.interp(at, self.edges, self.square)
        plain = np.interp(at, self.edges, self.plain)
        return np.diff(square, axis=1) / STEP, np.diff(plain, axis=1) / STEP


def _integrals(source: Channel, end: float) -> tuple[Floats, Floats, Floats]:
    """Edges and running integrals of V|V| and V; a command is held, a measured voltage runs straight."""
    good = np.isfinite(source.value)
    t, V = source.time[good], source.value[good]
    t, V = np.append(t, max(end, t[-1]) + WARM_UP), np.append(V, V[-1])
    level = V[:-1] if source.quantity == "command_voltage" else (V[1:] + V[:-1]) / 2
    width = np.diff(t)
    edges = np.concatenate([[t[0] - WARM_UP], t])
    square = np.concatenate([[0.0, 0.0], np.cumsum(level * np.abs(level) * width)])
    return edges, square, np.concatenate([[0.0, 0.0], np.cumsum(level * width)])


def _stretches(source: Channel, times: Floats) -> list[tuple[float, float]]:
    """(from, to) while the rotor is driven: no zero voltage for longer than RELEASED."""
    V = source.held_at(times)
    small = (
        1e-6 * float(np.nanmax(np.abs(V)))
        if source.quantity == "command_voltage"
        else 0.01 * float(np.nanmax(np.abs(V)))
    )
    driven = np.flatnonzero(np.abs(np.nan_to_num(V)) > small)
    if driven.size == 0:
        return []
    breaks = np.flatnonzero(np.diff(times[driven]) > RELEASED)
    firsts = driven[np.concatenate([[0], breaks + 1])]
    lasts = driven[np.concatenate([breaks, [driven.size - 1]])]
    return [(float(times[a]), float(times[b])) for a, b in zip(firsts, lasts, strict=True)]


def _started(t: Floats, n: Floats, at: float, rest: bool) -> float:
    low, high = (at - START, at) if rest else (at - START / 4, at + START / 4)
    inside = (t >= low) & (t <= high)
    return float(n[inside].mean()) if inside.any() else float(np.interp(at, t, n))


def drive(recording: Recording) -> Drive | Unusable:
    """Pieces of a recording with rotation rate and voltage; a sentence when it has no such thing."""
    who = f"recording {recording.source or recording.recording_id}"
    rate = recording.first_of("rotation_rate")
    source = recording.first_of("command_voltage") or recording.first_of("motor_voltage")
    if rate is None or not np.any(np.isfinite(rate.value)):
        return Unusable(f"{who}: no rotation_rate was recorded; n' = beta T - alpha n|n| cannot be identified")
    if source is None or not np.any(np.isfinite(source.value)):
        return Unusable(f"{who}: no voltage was recorded; the torque behind n' = beta T - alpha n|n| is not known")
    good = np.isfinite(rate.value)
    t, n = rate.time[good], rate.value[good]
    V = np.nan_to_num(source.value)
    if n.min() > -0.01 * n.max() and V.min() < -SIDED * V.max():
        return Unusable(f"{who}: the rotation rate never turns negative while the voltage does; give it its sign")
    if _turns_one_way(n, V[np.maximum(np.searchsorted(source.time, t, side="right") - 1, 0)]):
        return Unusable(f"{who}: the rotation rate goes the same way for both signs of the voltage; give it its sign")
    return _cut(who, source, t, n)


def _turns_one_way(n: Floats, V: Floats) -> bool:
    """Whether a rate (n,) has lost its sign, all but where the rotor was still on its way."""
    least = SIDED * np.abs(V).max()
    forward, back = least < V, -least > V
    if not (forward.any() and back.any()):
        return False
    ahead, behind = np.median(n[forward]), np.median(n[back])
    return bool(ahead * behind > 0 and min(abs(ahead), abs(behind)) > SIDED * np.quantile(np.abs(n), 0.95))


def _cut(who: str, source: Channel, t: Floats, n: Floats) -> Drive | Unusable:
    starts: list[float] = []
    first: list[float] = []
    times, rates, piece = [], [], []
    stretches = _stretches(source, t)
    for low, high in stretches:
        for begin in np.arange(low, high, PIECE):
            inside = (t >= begin) & (t < min(begin + PIECE, high + 1e-9))
            if not inside.any():
                continue
            start = max(low, float(begin) - WARM_UP)
            piece.append(np.full(int(inside.sum()), len(starts), dtype=np.intp))
            starts.append(start)
            first.append(_started(t, n, start, rest=start == low))
            times.append(t[inside])
            rates.append(n[inside])
    if sum(part.size for part in times) < FEWEST:
        return Unusable(f"{who}: fewer than {FEWEST} samples of a driven rotor; its dynamics cannot be seen")
    runs = from_voltage(source, t, 8)
    driven = [w for w in runs if any(a <= w.t_start + RELEASED and w.t_end <= b + RELEASED for a, b in stretches)]
    holds = tuple((w.voltage, w.t_start, w.t_end) for w in driven)
    return Drive(
        *_integrals(source, float(t[-1])), np.array(starts), np.array(first),
        np.concatenate(times), np.concatenate(rates), np.concatenate(piece), holds,
    )  # fmt: skip


def steps_of(drives: Sequence[Drive]) -> int:
    """Steps that reach the last sample of the longest piece."""
    longest = max(float(np.max(d.time - d.starts[d.piece])) for d in drives)
    return int(np.ceil(longest / STEP)) + 1
