"""Periodic disturbances in the residual at full rate: mains, pick-up, blade pass.

A line of fixed frequency a sin(2 pi f t + p), or one locked to the rotor, a (n/n_max)^q sin(2 pi z theta + p) with
theta the angle turned; q is 2 of a force of the rotor, 0 of a pick-up (order_law). The most significant of either kind
is found, fitted by least squares and taken out, until none passes.

A line must stand above the noise of its neighbours at a family-wise false-alarm rate over all that is searched
(spectrum), and a Lorentz peak of noise must not explain it as well (Whittle likelihood, see `peak_p_value`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from identification.mismatch import policy
from identification.mismatch.periodic.line_or_order import as_turning
from identification.mismatch.periodic.line_width import peak_p_value
from identification.mismatch.periodic.order_law import PICK_UP, OrderLaw, Ring
from identification.mismatch.periodic.order_tracking import RotorOrder, find_locked
from identification.mismatch.periodic.recurrence import Recurrence, of_frequency, power
from identification.mismatch.periodic.rotor_angle import Part, wave_of
from identification.mismatch.periodic.spectrum import (
    FAR,
    Series,
    Spectrum,
    clipped,
    family_wise,
    finite,
    spacing_of,
    spectrum_of,
    tail,
)
from identification.mismatch.periodic.steady_segments import speed_of
from identification.recording import Floats

EFFECT = "periodic_disturbance"
"""Its id: it has no term, for a line is found in the spectrum and taken out."""
TRIED = 6
"""Peaks that are looked at before a spectrum holds no line."""
MAINS = (50.0, 60.0)
"""Hz; standard frequencies of IEC 60196."""
HARMONICS = (1, 2, 3, 4, 5)
"""Of the mains that are told by name: rectifiers make the lower ones."""


@dataclass(frozen=True, eq=False)
class Line:
    """One periodic disturbance. Standard errors are of the noise beside the line."""

    kind: Literal["fixed", "rotation"]
    frequency: float
    """Hz; of a rotor-locked line at the mean speed of the turning rotor."""
    frequency_std: float
    ratio: float | None
    """Periods per `unit`, of a rotor-locked line."""
    ratio_std: float | None
    amplitude: float
    """N, of the force before the device that samples it; of a rotor-locked line at `top`."""
    amplitude_std: float
    phase: float | None
    """rad of a sin(2 pi f t + phase) in the first run; None where it differs from stretch to stretch."""
    phase_std: float | None
    p_value: float
    """Family-wise."""
    gain: float
    """In chi-square."""
    statement: str
    rival: Line | None = None
    """Of the other kind, where it explains it about as well."""
    parts: tuple[Part, ...] = ()
    unit: Literal["rev", "V s"] = "rev"
    """Of the turns: V s where no rate was recorded."""
    band: tuple[float, float] = (0.0, 0.0)
    """Hz, in which it shows: the frequency -+ 1/T of the longest run; of a rotor-locked line over nine tenths of the
    time in which it turns."""
    law: OrderLaw = PICK_UP
    """How a rotor-locked line grows with the speed."""
    top: float = 0.0
    """Highest speed of the rotor, turns per s."""
    power: float = 0.0
    """N^2, mean square over all samples."""
    searched: int | None = None
    """Frequencies that were looked at; None of one locked to the rotor: its p-value counts them otherwise."""
    seen: Recurrence | None = None
    """Whether it comes again in other runs, or in other parts of the only one; None where it was not asked."""

    @property
    def shown_amplitude(self) -> float:
        """N, of the wave that the samples show, by its mean square over all of them."""
        return float(np.sqrt(2 * self.power))

    @property
    def again(self) -> bool:
        """Whether it may be told by name."""
        return self.seen is None or self.seen.again

    def at(self, time: Floats, turns: Floats | None = None, run: int = 0) -> Floats:
        """(n,) N, the line at these times (and turns) of that run."""
        if self.kind == "rotation" and turns is None:
            raise ValueError("a line locked to the rotor needs the turns at these times")
        angle = 2 * np.pi * (self.frequency * time if self.ratio is None or turns is None else self.ratio * turns)
        return wave_of(self.parts, run, time, angle)


Band = tuple[float, float]
"""Hz."""


def find_lines(
    runs: Sequence[Series],
    *,
    turns_unit: Literal["rev", "V s"] = "rev",
    ring: Ring | None = None,
    skipped: Sequence[Band] = (),
) -> tuple[Line, ...]:
    """Every line in the residuals of one thruster's runs, the most significant first.

    `Series.turns`: see `turned`. Rotor-locked lines are searched where all runs have them; where the rotor stands
    still they are silent. `ring`: of a stand that is known to ring. `skipped`: where no line of one frequency is looked
    for. Runs of fewer than LINE_SAMPLES samples are left out.
    """
    left = [finite(r) for r in runs]
    found: list[Line] = []
    while len(found) < policy.periodic.LINES:
        best = _best(left, turns_unit, ring, skipped)
        if best is None:
            break
        found.append(_placed(best, left))
        left = [
            replace(r, residual=r.residual - best.at(r.time, r.turns, i)) if r.time.size else r
            for i, r in enumerate(left)
        ]
    return tuple(found)


def _placed(line: Line, runs: Sequence[Series]) -> Line:
    """With its band and power."""
    waves = [line.at(r.time, r.turns, i) for i, r in enumerate(runs)]
    power = sum(float(w @ w) for w in waves) / sum(w.size for w in waves)
    low = high = line.frequency
    if line.ratio is not None:
        turning = [speed_of(r)[w != 0] for r, w in zip(runs, waves, strict=True) if np.count_nonzero(w) > 1]
        low, high = line.ratio * np.quantile(np.concatenate(turning), (0.05, 0.95))
    resolution = 1 / max(float(np.ptp(r.time)) for r in runs if r.time.size)
    return replace(line, band=(max(float(low) - resolution, 0.0), float(high) + resolution), power=power)


def _best(
    runs: Sequence[Series], unit: Literal["rev", "V s"], ring: Ring | None, skipped: Sequence[Band]
) -> Line | None:
    alarm = policy.periodic.LINE_FALSE_ALARM
    long = [(i, r) for i, r in enumerate(runs) if r.time.size >= policy.periodic.LINE_SAMPLES]
    if not long:
        return None
    fixed = _fixed(long, skipped)
    locked = None
    if all(r.turns is not None for _, r in long):
        share = policy.periodic.LOCKED_LINE_SHARE
        found = find_locked(long, share * alarm, in_turns=unit == "rev", ring=ring)
        locked = None if found is None else _locked(found, unit)
    if fixed is not None and locked is None and all(r.turns is not None for _, r in long):
        turning = as_turning(long, fixed.frequency, fixed.amplitude_std, fixed.p_value)
        if turning is None or fixed.gain - turning.gain > policy.periodic.LINE_KINDS_CHI2:
            return fixed
        return replace(fixed, rival=_locked(replace(turning, seen=fixed.seen), unit))  # no search for orders found it
    if fixed is None or locked is None:
        return fixed or locked
    better, other = (fixed, locked) if fixed.gain >= locked.gain else (locked, fixed)
    return replace(better, rival=other) if better.gain - other.gain < policy.periodic.LINE_KINDS_CHI2 else better


def _fixed(runs: Sequence[tuple[int, Series]], skipped: Sequence[Band] = ()) -> Line | None:
    """The most significant line of one frequency."""
    alarm = policy.periodic.LINE_FALSE_ALARM
    spacings = [spacing_of(r.time) for _, r in runs]
    spacing, even = min(s for s, _ in spacings), all(e for _, e in spacings) and len({s for s, _ in spacings}) == 1
    spans = [float(r.time[-1] - r.time[0]) for _, r in runs]
    spectra = [spectrum_of(r, max(spans), spacing, even=even) for _, r in runs]
    step = spectra[0].step
    ratio = np.mean([s.power / s.noise for s in spectra], axis=0)
    first = int(np.ceil(max(policy.periodic.LOWEST_LINE, policy.periodic.LINE_PERIODS / max(spans)) / step))
    ratio[:first] = 0.0
    for low, high in skipped:
        ratio[max(int(np.floor(low / step)), 0) : int(np.ceil(high / step)) + 1] = 0.0
    trials = float(np.sum([np.sqrt(4 * np.pi * np.var(r.time)) for _, r in runs])) * (0.5 / spacing)
    for _ in range(TRIED):
        at = int(np.argmax(ratio))
        if at < first or _p_value(float(ratio[at]), len(runs), trials) > alarm * 10:
            return None
        line = _fitted(runs, spectra, at, trials, spacing)
        if line is not None and line.p_value < alarm:
            return line
        ratio[max(at - int(FAR / 2), 0) : at + int(FAR / 2)] = 0.0
    return None


def _p_value(mean_ratio: float, runs: int, trials: float) -> float:
    return family_wise(tail(mean_ratio, runs, FAR), runs * mean_ratio, trials)


def _fitted(
    runs: Sequence[tuple[int, Series]], spectra: Sequence[Spectrum], at: int, trials: float, spacing: float
) -> Line | None:
    """Frequency by least squares round a grid point, coefficients run by run; None beyond the searched band."""
    from scipy.optimize import minimize_scalar  # a quarter of a second, and few recordings come here

    step = spectra[0].step
    noise = [float(s.noise[at]) for s in spectra]
    values = [clipped(r.residual) for _, r in runs]

    def ratio(f: float) -> float:
        return sum(power(r.time, v, f) / s for (_, r), v, s in zip(runs, values, noise, strict=True))

    found = minimize_scalar(
        lambda f: -ratio(f), bounds=((at - 1) * step, (at + 1) * step), method="bounded", options={"xatol": 1e-3 * step}
    )
    f = float(found.x)
    p = _p_value(ratio(f) / len(runs), len(runs), trials)
    loudest = int(np.argmax([power(r.time, v, f) / s for (_, r), v, s in zip(runs, values, noise, strict=True)]))
    p = max(p, peak_p_value(runs[loudest][1].time, values[loudest], f))
    parts, waves, precision = [], [], []
    for (i, r), s in zip(runs, noise, strict=True):
        a, b = _coefficients(r.time, clipped(r.residual), f)
        passed = _passed(r, f)
        parts.append(Part(i, -np.inf, np.inf, a, b))
        waves.append(complex(a, -b) / passed)
        precision.append(abs(passed) ** 2 * r.time.size / (2 * s))
    sizes = np.abs(waves)
    amplitude = float(np.average(sizes, weights=precision))
    std = float(1 / np.sqrt(np.sum(precision)))
    spread = np.array([np.var(r.time) for _, r in runs])
    f_std = float(1 / (2 * np.pi * amplitude * np.sqrt(np.sum(precision * spread))))
    first_std = float(1 / (sizes[0] * np.sqrt(precision[0])))
    phase_std = float(np.hypot(first_std, 2 * np.pi * f_std * float(np.mean(runs[0][1].time))))
    phase = float(np.angle(waves[0] * 1j))
    says = _fixed_says(f, amplitude, spacing)
    return Line(
        *("fixed", f, f_std, None, None, amplitude, std, phase, phase_std, p, 2 * ratio(f), says),
        parts=tuple(parts),
        searched=int(np.ceil(trials)),
        seen=of_frequency(runs, noise, f),
    )


def _passed(run: Series, f: float) -> complex:
    """What its samples hold of a wave of `f` Hz; all of it where they could hold nothing, so that it came later."""
    response = complex(run.converter.response(np.array([f]))[0])
    return response if abs(response) > policy.periodic.LEAST_PASSED else 1.0


def _coefficients(time: Floats, value: Floats, f: float) -> tuple[float, float]:
    angle = 2 * np.pi * f * time
    X = np.column_stack([np.cos(angle), np.sin(angle), np.ones_like(angle)])
    a, b, _ = np.linalg.lstsq(X, value, rcond=None)[0]
    return float(a), float(b)


def alias_of_mains(f: float, spacing: float, within: float) -> float | None:
    """Harmonic of the mains (Hz) that samples `spacing` s apart show at `f`, to `within` Hz; None without one."""
    rate = 1.0 / spacing
    for mains in MAINS:
        for harmonic in HARMONICS:
            true = mains * harmonic
            seen = abs(true - rate * round(true / rate))
            if abs(seen - f) < within + policy.periodic.MAINS_WANDER * true:
                return true
    return None


def _fixed_says(f: float, amplitude: float, spacing: float) -> str:
    says = f"Periodic disturbance of {amplitude:.3g} N at {f:.4g} Hz"
    true = alias_of_mains(f, spacing, 0.02)
    if true is not None and true < 0.5 / spacing:
        says += f", which is mains ({true:g} Hz)"
    elif true is not None:
        says += f"; sampled at {1 / spacing:.4g} Hz, mains of {true:g} Hz would show there"
    return says + "."


def _locked(found: RotorOrder, unit: Literal["rev", "V s"]) -> Line:
    per = "turn" if unit == "rev" else "V s of the driver"
    near = round(found.ratio)
    blades = (
        unit == "rev"
        and near >= 1
        and abs(found.ratio - near) < max(policy.periodic.BLADE_RATIO_NEAR, 4 * found.ratio_std)
    )
    grows = (
        f" at {found.top:.3g} {'turns/s' if unit == 'rev' else 'V'}, as the square of the speed at less,"
        if found.law.growth
        else ""
    )
    ringing = " and as the stand rings" if found.law.ring else ""
    says = f"Periodic disturbance of {found.amplitude:.3g} N{grows}{ringing} locked to the rotor, {found.ratio:.4g} "
    says += f"periods per {per}"
    says += f" (blade pass of {near} blades, or the {near}. order of the shaft)" if blades and near > 1 else ""
    says += ": silent at rest."
    speed = found.speed
    return Line(
        "rotation",
        found.ratio * speed,
        found.ratio_std * speed,
        found.ratio,
        found.ratio_std,
        found.amplitude,
        found.amplitude_std,
        found.phase,
        found.phase_std,
        found.p_value,
        found.gain,
        says,
        parts=found.parts,
        unit=unit,
        law=found.law,
        top=found.top,
        seen=found.seen,
    )
