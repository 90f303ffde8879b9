"""Cell or amplifier clips: clip(F, -limit, limit); or shows less and less from an onset on, until a knee is passed.

An amplifier or a converter that clips takes the noise with it. A cell on its stop does not: what the amplifier behind
it adds goes on, so that silence speaks for a clip but noise does not speak against it. Where a sample is the mean of
many conversions, each clips with a noise of its own, which the samples do not show. Where the zero was set behind
what clips, by a tare in software say, readings end at two values whose middle is not 0: the forms off centre.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Final, Literal

import numpy as np
from scipy.special import ndtr

from identification.physics.soft_limit import knee, limited, slope_at
from identification.physics.term import EquationContext, Parameter, Scale, Stage, TermContext
from identification.physics.traits import Traits
from identification.recording import Floats
from identification.run_history.history import TAIL, History

FAR = 8.0
"""Standard deviations of the noise: what is farther from the limit clips always, or never."""
LEAST_MOVE = 1e-6
"""Of the limit: what moves less within an interval stands still."""
LEAST_BLUR = 0.01
"""The same, of the noise."""
MOST_NOISE, LEAST_NOISE = 0.3, 1e-3
"""Of the largest reading: of a conversion. More makes a limit another curve, less is a limit met at once."""
TRIED_NOISE = 0.02
"""The same, where a search begins: a fit finds any other from there."""
CLIPS_SELDOM = 2.0
"""Standard deviations below the limit: one conversion in forty clips there, and the mean shows less from there on."""
NOISE_TOLD = "the noise of a conversion"
LOWEST_KNEE = 0.25
"""Of the largest reading: what bends from less on is no limit, but another curve."""
FARTHEST, TRIED_MIDDLE = 0.5, 0.03
"""Of the largest reading: the middle between two ends; and where it is looked for first."""
TRAITS: Final = Traits(
    limits="reading",
    told_by=(("rotation_rate", "the measured rotation rate"), ("current", "the measured current")),
    revealed_by="current or rotation rate at the highest levels: they go on rising",
)
CLOSER: Final = replace(TRAITS, closer=True)


def _beyond(z: Floats, half: Floats, noise: float) -> Floats:
    """Mean of max(z + u + e, 0): u even within +-half, e normal of standard deviation `noise`."""
    out = np.where(z > 0, z, 0.0)
    near = np.abs(z) < half + FAR * noise
    u, h = z[near], half[near]
    out[near] = (_integral(u + h, noise) - _integral(u - h, noise)) / (2 * h)
    return out


def _integral(z: Floats, noise: float) -> Floats:
    """Mean of max(z + e, 0)^2 / 2."""
    if noise <= 0:
        hard: Floats = 0.5 * np.maximum(z, 0.0) ** 2
        return hard
    s = z / noise
    out: Floats = 0.5 * noise**2 * ((1 + s**2) * ndtr(s) + s * np.exp(-0.5 * s**2) / np.sqrt(2 * np.pi))
    return out


@dataclass(frozen=True, slots=True)
class LoadCellSaturation:
    """Cell or amplifier clips: clip(F, -limit, limit); or shows less and less from an onset on, over a knee."""

    id: ClassVar[str] = "load_cell_saturation"
    stage: ClassVar[Stage] = "cell"
    physics: ClassVar[str] = "the load cell or its amplifier clips"
    needs: ClassVar[tuple[str, ...]] = ()
    covariates: ClassVar[tuple[str, ...]] = ("thrust",)
    form: Literal["hard", "before_noise", "averaged", "knee", "off_centre", "off_centre_before_noise"] = "hard"

    @property
    def traits(self) -> Traits:
        return CLOSER if self._off_centre else TRAITS

    @property
    def sharp(self) -> bool:
        """Whether readings end at one value, and not over a knee, or the more the noise of a conversion."""
        return self.form not in ("averaged", "knee")

    @property
    def silent(self) -> bool:
        """Whether the amplifier's own noise is clipped too."""
        return not self.form.endswith("before_noise")

    @property
    def _off_centre(self) -> bool:
        return self.form.startswith("off_centre")

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        most = 1.3 * scale.reading
        limit = Parameter("limit", "N", 0.1 * scale.reading, most, most)
        if self._off_centre:
            return limit, Parameter("middle", "N", -FARTHEST * scale.reading, FARTHEST * scale.reading)
        if self.sharp:
            return (limit,)
        if self.form == "averaged":
            noise = Parameter("noise", "N", LEAST_NOISE * scale.reading, MOST_NOISE * scale.reading, told=NOISE_TOLD)
            return limit, noise
        bend = Parameter("bend", "1/N", 0.0, 50.0 / scale.reading, 0.0)
        return bend, Parameter("onset", "N", LOWEST_KNEE * scale.reading, 0.98 * scale.reading)

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        if self._off_centre:
            return tuple((0.88 * scale.reading, middle * scale.reading) for middle in (TRIED_MIDDLE, -TRIED_MIDDLE))
        if self.sharp:
            shares = (0.99, 0.95, 0.88, 0.75, 0.6) if self.silent else (0.95, 0.88, 0.75, 0.6)
            return tuple((share * scale.reading,) for share in shares)
        if self.form == "averaged":
            return tuple((share * scale.reading, TRIED_NOISE * scale.reading) for share in (0.99, 0.95, 0.88, 0.75))
        return tuple((0.5 / scale.reading, share * scale.reading) for share in (0.3, 0.5, 0.7, 0.88))

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        # the mean of noisy samples that clip one by one while the force moves within the interval
        noise, tails = (now.history.scatter or (now.scale.noise, 0.0)) if self.silent else (0.0, 0.0)
        half = np.maximum(
            _half_moved(now.history, now.C, now.x), max(LEAST_MOVE * now.scale.reading, LEAST_BLUR * noise)
        )
        if self.form == "knee":  # within a knee the mean shows the variance of what moves, not its distribution
            spread = np.sqrt(half**2 + 3 * noise**2 * (1 + tails * (TAIL**2 - 1)))
            reading = value + now.tare
            bent: Floats = np.copysign(limited(np.abs(reading), spread, *theta), reading) - now.tare
            return bent
        out = value.copy()
        each = ((1.0, theta[1]),) if self.form == "averaged" else ((1 - tails, noise), (tails, TAIL * noise))
        for share, std in each:
            if share > 0:
                off = value + now.tare - self._middle(theta)
                over, under = off - theta[0], -theta[0] - off
                out -= share * (_beyond(over, half, std) - _beyond(under, half, std))
        return out

    def shown(self, history: History, C: float, x: Floats, reading: Floats, theta: tuple[float, ...]) -> Floats:
        """(M,) share of what the force does within each interval that the cell shows, from the mean reading there."""
        if self.form == "knee":
            return slope_at(np.abs(reading), *theta)
        half = _half_moved(history, C, x)
        if self.form == "averaged":
            half = np.hypot(half, np.sqrt(3) * theta[1])  # an even motion of that variance
        # limit - half share^2 is the clipped mean of an even motion
        short = np.maximum(theta[0] - np.abs(reading - self._middle(theta)), 0.0)
        out: Floats = np.sqrt(np.minimum(short / np.maximum(half, LEAST_MOVE * theta[0]), 1.0))
        return out

    def slope(self, reading: Floats, theta: tuple[float, ...]) -> Floats:
        """What the cell would show of a small change where it reads `reading` N if it were endless."""
        beyond = np.abs(reading) - self.start(theta, np.sign(reading))
        if self.sharp:
            return np.where(beyond > 0, 0.0, 1.0)
        if self.form == "averaged":
            return np.asarray(ndtr((theta[0] - np.abs(reading)) / theta[1]), dtype=np.float64)
        out: Floats = np.clip(1 - theta[0] * np.maximum(beyond, 0.0), 0.0, 1.0)
        return out

    def start(self, theta: tuple[float, ...], side: Floats | float) -> Floats | float:
        """N, by size: where the cell begins to show less, on a side, 1 or -1."""
        if self.form == "averaged":
            return theta[0] - CLIPS_SELDOM * theta[1]
        return theta[0] + side * self._middle(theta) if self.sharp else theta[1]

    def _middle(self, theta: tuple[float, ...]) -> float:
        """N: of the two ends of the readings."""
        return theta[1] if self._off_centre else 0.0

    def _ends(self, theta: tuple[float, ...]) -> tuple[float, float]:
        return self._middle(theta) - theta[0], self._middle(theta) + theta[0]

    def equation(self, theta: tuple[float, ...], model: EquationContext) -> tuple[str, ...]:
        if self.form == "knee":
            return "F = F + tare", *knee("F", *theta), "F = F - tare"
        if self.form == "averaged":
            what = "the mean of clip(F + e, -limit, limit), e normal of standard deviation noise"
            return (f"F = clipped_mean(F + tare, {theta[0]:.6g}, {theta[1]:.6g}) - tare  # (F, limit, noise): {what}",)
        noise = "each sample with its noise" if self.silent else "before the noise of the amplifier"
        low, high = self._ends(theta)
        return (f"F = clip(F + tare, {low:.6g}, {high:.6g}) - tare  # {noise}",)

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        advice = "change the range of the amplifier or the cell"
        if self._off_centre:
            low, high = self._ends(theta)
            return f"Load-cell saturation: readings end at {low:.4g} and {high:.4g} N; {advice}."
        if self.sharp:
            return f"Load-cell saturation: readings end at +-{theta[0]:.4g} N; {advice}."
        if self.form == "averaged":
            return (
                f"Load-cell saturation: each conversion that a sample is the mean of ends at +-{theta[0]:.4g} N, with "
                f"{theta[1]:.2g} N of noise of its own; {advice}."
            )
        return f"Load-cell saturation: from {theta[1]:.4g} N on readings show less and less of the force; {advice}."


def _half_moved(history: History, C: float, x: Floats) -> Floats:
    """(M,) N: half of how far the force moves within each interval, by the variance of the driver there."""
    out: Floats = C * np.abs(x) * np.sqrt(12 * np.abs(history.excess))
    return out


FORMS = (
    LoadCellSaturation("hard"),
    LoadCellSaturation("before_noise"),
    LoadCellSaturation("averaged"),
    LoadCellSaturation("knee"),
    LoadCellSaturation("off_centre"),
    LoadCellSaturation("off_centre_before_noise"),
)
