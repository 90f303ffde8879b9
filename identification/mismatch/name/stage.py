"""The stage: the model and what it leaves in, its terms out as names, each with the checks that it fails."""

from __future__ import annotations

from identification.mismatch.locate.stage import Located
from identification.mismatch.name.naming import Named, name, with_joint_checks
from identification.mismatch.select.forward_selection import Selected


def run(selected: Selected, located: Located) -> tuple[Named, ...]:
    """Every term of the model with what speaks for and against its name, the largest gain first."""
    data = selected.data
    named = name(located.estimate, data, selected.terms, selected.standing)
    return with_joint_checks(named, located.left if located.structured else None, measured=data.with_rate)
