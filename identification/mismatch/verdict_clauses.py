"""Findings as clauses of the verdict's sentence."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from identification.mismatch.diagnosis import Finding

NOT_WHITE = (
    "intervals and p-values rest on the noise model, which does not describe all of it: they may be surer than they "
    "should"
)


def sureness(f: Finding) -> str:
    """How many alternatives were looked at before it was taken, and its weight among those fitted in its place."""
    says = f"the best of {f.searched} alternatives looked at" if f.searched is not None and f.searched > 1 else ""
    weight = f"weight {f.probability:.2g} among the {f.asked} effects asked ('none of these' was not)"
    return ", ".join(part for part in (says, weight if f.asked > 1 else "") if part)


def degree(f: Finding) -> str:
    """Its grade with its share; empty where that was not judged."""
    if f.share is None or f.heldout is None:
        return ""
    without, with_it = f.heldout
    return (
        f"{f.grade}: not fitted {without:.4g} without it, {with_it:.4g} with it, {100 * f.share:.0f} % of what any "
        "shape could take off"
    )


def mostly(f: Finding) -> str:
    """With what it does on what was not fitted."""
    says = f"Mostly {f.statement[:1].lower()}{f.statement[1:]}"
    if f.heldout is None or f.share is None:
        return says
    without, with_it = f.heldout
    return (
        f"{says} It takes the error on what was not fitted from {without:.3g} to {with_it:.3g}, "
        f"{100 * f.share:.0f} % of what any shape could take off."
    )


def either(f: Finding) -> str:
    """It or its rivals; by form, where they are one effect."""
    every = [(f.effect, f.form), *((r.effect, r.form) for r in f.rivals)]
    same = len({effect for effect, _ in every}) < len(every)
    return " or ".join(f"{effect} ({form})" if same and form else effect for effect, form in every)
