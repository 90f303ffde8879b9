"""What stands in for a channel that an effect needs and nobody recorded: the answer says so."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from identification.mismatch.diagnosis import Finding
from identification.mismatch.model.model import Model
from identification.mismatch.prepare.channels import neighbour_of
from identification.physics.catalogue import traits_of
from identification.physics.traits import Proxy
from identification.recording import Recording
from identification.run_history.history import History

TURNS = "periods_per_volt_second"
"""Parameter of a line that is locked to the integral of the voltage."""


def proxies(
    model: Model, findings: Sequence[Finding], recordings: Sequence[Recording], histories: Sequence[History]
) -> tuple[str, ...]:
    """A sentence for each that the model, a finding or a rival of one makes use of.

    `histories`: of the recordings, in their order, with what all of them hold.
    """
    used = [(term.id, term.form) for term in (*(g.term for g in model.given), *model.terms)]
    used += [(f.effect, f.form) for f in findings] + [(r.effect, r.form) for f in findings for r in f.rivals]
    have = {histories[0].driver_quantity}.union(set.intersection(*(set(h.others) for h in histories)))
    known = [(effect, traits) for effect, form in used if (traits := traits_of(effect, form)) is not None]
    out = [_said(effect, traits.proxy, have) for effect, traits in known if traits.proxy is not None]
    if _by_command(recordings):
        instead = "the neighbour's thrust was not recorded; V|V| of its command stands for it."
        out += [f"{effect}: {instead}" for effect, traits in known if traits.neighbour]
    by_volts = (f.effect for f in findings if TURNS in f.parameters)
    out += [f"{e}: no rotation rate was recorded; the integral of |V| stands for the rotor's turns." for e in by_volts]
    return tuple(dict.fromkeys(text for text in out if text))


def _said(effect: str, proxy: Proxy, have: Collection[str]) -> str:
    """Empty where the quantity was recorded."""
    if proxy.quantity in have:
        return ""
    quantity, better = proxy.better or ("", "")
    instead = better if quantity in have else proxy.instead
    return f"{effect}: {proxy.lacks}; {instead} stands for it."


def _by_command(recordings: Sequence[Recording]) -> bool:
    """Whether a neighbour is known by its command in one of them."""
    known = [neighbour_of(recording) for recording in recordings]
    return any(channel is not None and channel.quantity == "command_voltage" for channel in known)
