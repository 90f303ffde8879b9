"""What no name carries: where it is, its shape, what it resembles, and the flexible term or formula that models it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from identification.mismatch import policy
from identification.mismatch.answer.advice import what_to_do
from identification.mismatch.locate.places import locate, says
from identification.mismatch.model.data import Data
from identification.mismatch.name.naming import Named
from identification.mismatch.unexplained import Remainder
from identification.mismatch.unnamed.flexible import foremost
from identification.mismatch.unnamed.flexible_shape import with_flexible
from identification.mismatch.unnamed.shares import only_repairs
from identification.mismatch.unnamed.stage import Completed, foremost_covariate
from identification.mismatch.verdict_clauses import refused
from identification.run_history.history import History


def remainder_of(completed: Completed, data: Data, unseen: Sequence[History]) -> Remainder | None:
    """None where nothing is left and every term has its name."""
    if not completed.open_ended:
        return None
    left, bare, unearned, flexible = completed.left, completed.bare, completed.unearned, completed.flexible
    quantity = flexible.terms[0].quantity if flexible is not None else foremost_covariate(left, unearned, data)
    if flexible is None and left.p_value < policy.locate.RESIDUAL_FALSE_ALARM:
        clear = [g.covariate.quantity for g in left.groups if g.p_value < policy.locate.RESIDUAL_FALSE_ALARM]
        quantity = foremost(bare, data, clear or [quantity], left.pulses)
    judged = next((g for g in left.groups if g.covariate.quantity == quantity), left.groups[0])
    place = locate(judged.covariate, bare.fit, data, bare.weights)
    resembles = tuple(f"{n.term.id}: {'; '.join(n.failed_checks)}" for n in unearned)
    text = f"{_what(unearned)}: {says(place)}"
    repairs = bool(unearned) and len(only_repairs(unearned)) == len(unearned)
    if repairs:
        names = " or ".join(n.term.id.replace("_", " ") for n in unearned)
        text += f" It is mostly {names}: each explains nearly the same alone, and neither all of it."
    found = Remainder(place.where, judged.share, left.p_value, place.table, text, resembles)
    found = with_flexible(found, flexible, data, unseen)
    tried = refused([(n.term.id, n.failed_checks[0]) for n in unearned]) if unearned and not repairs else ""
    return replace(found, statement=" ".join(filter(None, [found.statement, what_to_do(quantity), tried])))


def _what(unearned: Sequence[Named]) -> str:
    """What is left, in a word: what would carry it is no name where the samples can't tell whose it is."""
    quick = [any(check.kind == "sampled" and check.failed for check in n.checks) for n in unearned]
    if quick and all(quick):
        return "Something quick is left, of which the samples do not say whose it is"
    return "Something is left that no term of the catalogue carries"
