"""Has a thruster changed? Its fits in order of time, each against the first and the one before it.

The comparison is that of `rig fit --compare` (`identification.thruster.comparison`): Welch's t for each coefficient,
the gain error of the load cell left out of a difference whose two sides share the calibration, Holm for all of them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from identification.thruster.comparison import Change, Group, changes, share_calibration
from identification.thruster.repeatability import Repeatability, with_repeatability
from rig.fit.comparison import group_of_json


@dataclass(frozen=True, eq=False)
class DatedFit:
    """One fit of the thruster."""

    source: str
    began: float | None
    """s since 1970."""
    entry: Mapping[str, Any]
    """As `rig fit --json` has it."""


@dataclass(frozen=True, eq=False)
class Pair:
    """One coefficient of a later fit against an earlier one; both by their place in the order of time."""

    earlier: int
    later: int
    change: Change
    shared: bool
    """Both state the same calibration: its gain error is not in the difference."""

    @property
    def against(self) -> str:
        """What the earlier one is to the later."""
        names = (["first"] if self.earlier == 0 else []) + (["previous"] if self.earlier == self.later - 1 else [])
        return " and ".join(names)


@dataclass(frozen=True, eq=False)
class History:
    """Fits of one thruster and model, oldest first."""

    thruster: str
    model: str
    fits: tuple[DatedFit, ...]
    pairs: tuple[Pair, ...]
    repeat: Repeatability | None
    """What changes from one recording to the next within a campaign; None: no campaign has two."""
    remarks: tuple[str, ...]
    """What was left out and why, and what of the rest to look at."""

    @property
    def changed(self) -> bool:
        """Whether any pair differs, at 5 % for all together."""
        return any(pair.change.changed for pair in self.pairs)


def history(
    thruster: str,
    model: str,
    fits: Iterable[DatedFit],
    repeat: Repeatability | None = None,
    remarks: Sequence[str] = (),
) -> History:
    """In order of time; fits without a time stay in the order in which they came, behind the others."""
    ordered = sorted(fits, key=lambda fit: float("inf") if fit.began is None else fit.began)
    kept: list[DatedFit] = []
    groups: list[Group] = []
    out = list(remarks)
    for fit in ordered:
        group = group_of_json(fit.entry, thruster)
        if group is None:
            out.append(f"left out: {fit.source}: its coefficients are not determined")
        elif groups and (group.coefficients != groups[0].coefficients):
            out.append(f"left out: {fit.source}: fitted as {fit.entry['model']}, the others as {model}")
        else:
            kept.append(fit)
            groups.append(with_repeatability(group, repeat))
    return History(thruster, model, tuple(kept), _pairs(groups), repeat, tuple(out))


def _pairs(groups: Sequence[Group]) -> tuple[Pair, ...]:
    places = [(i, k) for k in range(1, len(groups)) for i in dict.fromkeys((0, k - 1))]
    both = [(groups[i], groups[k]) for i, k in places]
    names = [place for place in places for _ in groups[0].coefficients]
    shared = [share_calibration(pair) for pair in both for _ in groups[0].coefficients]
    found = changes(both)
    return tuple(Pair(*place, change, same) for place, change, same in zip(names, found, shared, strict=True))
