"""Is a peak of the spectrum a line, of width 1/T, or a resonance of noise, of many?

Both are fitted to the spectrum round the peak by Whittle's likelihood (each power an exponential variate about the
spectral density; Whittle, Ark. Mat. 2, 423, 1953): a Lorentz peak on a sloping floor, and the same after the line has
been taken out. Twice the difference is chi-square of three parameters (two of the line, and its frequency).
"""

from __future__ import annotations

import numpy as np

from identification.estimation.tails import chi2_sf
from identification.mismatch import policy
from identification.recording import Floats

ROUND = 32
"""Independent frequencies on either side."""
BLOCKS = 512
"""Sums in time from which the transform near the peak is made."""
WIDTHS = (1.0, 3.0, 10.0)
"""Half widths in 1/T from which the fit of a noise peak begins."""


def peak_p_value(time: Floats, residual: Floats, f: float) -> float:
    """How likely noise with a Lorentz peak is to look so much like a line at `f` (Hz)."""
    angle = 2 * np.pi * f * time
    X = np.column_stack([np.cos(angle), np.sin(angle)])
    left = residual - X @ np.linalg.lstsq(X, residual, rcond=None)[0]
    with_line, _ = _best(_near(time, left, f))
    without, width = _best(_near(time, residual, f))
    gain = max(without - with_line, 0.0)
    return float(min(1.0, (2 * width + 1) * float(chi2_sf(2 * gain, 3))))


def _near(time: Floats, residual: Floats, f: float) -> Floats:
    """(2 ROUND + 1,) powers at f + j/T."""
    span = time[-1] - time[0]
    block = np.minimum((BLOCKS * (time - time[0]) / span).astype(np.intp), BLOCKS - 1)
    turned = residual * np.exp(-2j * np.pi * f * time)
    sums = np.bincount(block, weights=turned.real, minlength=BLOCKS) + 1j * np.bincount(
        block, weights=turned.imag, minlength=BLOCKS
    )
    found = np.fft.fft(sums)
    out: Floats = np.abs(found[np.arange(-ROUND, ROUND + 1)]) ** 2 / time.size
    return out


def _best(power: Floats) -> tuple[float, float]:
    """Least half deviance over peaks and floors, and the peak's half width."""
    j = np.arange(-ROUND, ROUND + 1, dtype=np.float64)
    floor = float(np.median(power) / np.log(2)) or 1e-300
    top = float(np.max(power))

    def cost(q: Floats) -> float:
        x = (j - q[3]) / np.exp(q[4])
        density = np.exp(q[0] + q[1] * j / ROUND) + np.exp(q[2]) / (1 + x**2)
        return float(np.sum(np.log(density) + power / density))

    from scipy.optimize import minimize  # a quarter of a second, and few recordings come here

    base = float(np.log(floor))
    low = np.array([base - 7, -6, base - 12, -6, np.log(policy.periodic.LINE_WIDTH)])
    high = np.array([base + 7, 6, np.log(top + floor) + 3, 6, np.log(2 * ROUND)])
    bounds = list(zip(low.tolist(), high.tolist(), strict=True))
    found = []
    for width in WIDTHS:
        near = float(np.mean(power[np.abs(j) <= width]))
        start = np.array([np.log(floor), 0.0, np.log(max(near, 1e-3 * floor)), 0.0, np.log(width)])
        found.append(minimize(cost, np.clip(start, low, high), method="L-BFGS-B", bounds=bounds))
    best = min(found, key=lambda r: float(r.fun))
    return float(best.fun), float(np.exp(best.x[4]))
