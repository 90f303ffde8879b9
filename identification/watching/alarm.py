"""What is said of a mismatch: when it began, where it shows, how large it is. It locates; it names no physics."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from identification.watching.signatures import Place

WHERE: Final[dict[Place, str]] = {  # a headline fits into 80 columns
    "zero": "at rest and running alike",
    "running": "while running, in both directions",
    "forward": "while running forward",
    "reverse": "while running in reverse",
    "high": "at high levels above all",
    "bus": "while running, with bus voltage",
}
LOOK: Final[dict[Place, str]] = {
    "zero": "look at the cell's zero and what pulls on it: cables, struts, temperature; a rest at 0 V shows it alone",
    "running": "look at the propeller and at what drives it; the zero at rest has not moved with it",
    "forward": "look at what only forward thrust meets: the blades' faces, the duct's outlet, the front stop",
    "reverse": "look at what only reverse thrust meets: the blades' backs, the duct's inlet, the rear stop",
    "high": "repeat a low and a high level; look at supply, drive and water at full load",
    "bus": "look at the supply and its cables; hold one level and change the supply",
}
BRIEF: Final[dict[Place, str]] = {  # beside a fit in 80 columns
    "zero": "look at the cell's zero",
    "running": "look at the propeller",
    "forward": "look at the blades' faces",
    "reverse": "look at the blades' backs",
    "high": "repeat a low level",
    "bus": "look at the supply",
}


@dataclass(frozen=True, slots=True)
class Alarm:
    """A mismatch. Times in s of the recording."""

    time: float
    """When it was said."""
    began: float
    began_from: float
    """Earliest and latest begin that are likely: 90 % lie between."""
    began_to: float
    place: Place
    probability: float
    """Of that place among the places, 0..1."""
    rivals: tuple[Place, ...]
    """Other places with a probability above a tenth."""
    size: float
    """N, by now: of the zero, or at the highest command; there, forward and reverse, below 0 is a loss."""
    size_std: float
    """N, one standard deviation."""
    share: float | None
    """size over the thrust at the highest command; None for a zero."""
    growing: bool
    """It grows with time rather than having come at once."""
    e_value: float
    """Average likelihood ratio over all beginnings, places and sizes: p <= 1 / e_value."""
    from_start: bool = False
    """It was there from the first stretch on: the run does not fit the model that it is watched with."""

    @property
    def where(self) -> str:
        return WHERE[self.place]

    @property
    def what(self) -> str:
        """What is off and by how much: `thrust -3.1 % (-2.4 N)`."""
        size = f"{self.size:+.2g} N" if self.share is None else f"{100 * self.share:+.2g} % ({self.size:+.2g} N)"
        return f"{'zero' if self.place == 'zero' else 'thrust'} {size}"

    @property
    def sigma(self) -> float:
        """|size| in its standard deviations; inf where that is 0."""
        return abs(self.size) / self.size_std if self.size_std > 0 else float("inf")

    @property
    def brief(self) -> str:
        """What to do first, in a few words."""
        return BRIEF[self.place]

    @property
    def advice(self) -> str:
        """What to do."""
        return LOOK[self.place]

    @property
    def headline(self) -> str:
        """Short, for one line of a screen.

        >>> Alarm(320, 298, 290, 305, "running", 0.97, (), -2.4, 0.3, -0.031, False, 2e4).headline
        'thrust -3.1 % (-2.4 N) while running, in both directions, since 298 s'
        """
        since = "from the start" if self.from_start else f"since {self.began:.0f} s"
        return f"{self.what} {self.where}, {since}"

    @property
    def statement(self) -> str:
        """One sentence a person can act on, with how sure it is."""
        text = self.headline
        if not self.from_start and self.began_to - self.began_from > 1.0:
            text += f" (between {self.began_from:.0f} and {self.began_to:.0f} s)"
        text += f", ± {self.size_std:.1g} N" + (", growing" if self.growing else "")
        if self.rivals:
            text += "; may also be " + " or ".join(WHERE[r] for r in self.rivals)
        return f"{text}; e-value {self.e_value:.2g}; {self.advice}"
