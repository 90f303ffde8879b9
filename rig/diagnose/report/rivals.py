"""What tells one effect from another that explains a recording as well: the table of docs/physics in short."""

from __future__ import annotations

from identification.physics.catalogue import traits_of

WITHOUT_TERM = {
    "periodic_disturbance": "two levels, and rest with the power on; the same level at two sampling rates",
    "channel_fault": "one channel at a time against a known load or speed",
}
"""What would reveal effects that have no term in the catalogue."""


def told_apart(effect: str, rival: str, form: str = "", rival_form: str = "") -> str:
    """What would decide between two effects, as a clause.

    >>> told_apart("zero_drift", "unheard_of")
    'rests again and again: a zero that moves shows there, a gain does not (zero drift)'
    """
    forms = dict.fromkeys(((effect, form), (rival, rival_form)))
    told = (f"{clause} ({name.replace('_', ' ')})" for name, of in forms if (clause := _revealed_by(name, of)))
    return "; ".join(dict.fromkeys(told))


def _revealed_by(effect: str, form: str) -> str:
    """Empty where nobody knows."""
    traits = traits_of(effect, form)
    return WITHOUT_TERM.get(effect, "") if traits is None else traits.revealed_by
