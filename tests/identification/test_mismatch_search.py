"""What a search does with additions and exchanges that do not last."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from identification.mismatch import pipeline as diagnosing
from identification.mismatch.select import forward_selection as search


def state(*terms):
    return SimpleNamespace(fit=SimpleNamespace(model=SimpleNamespace(terms=terms)))


BASE, LAG, RING = state(), state("lag"), state("ring")


def larger(_state, _judged, _data, _terms, refused):
    return next((s for s in (LAG, RING) if not set(s.fit.model.terms) & set(refused)), None)


@pytest.mark.parametrize(("lasting", "found"), [((LAG, RING), LAG), ((RING,), RING), ((), None)])
def test_what_is_dropped_again_gives_way_to_the_next_best(monkeypatch, lasting, found):
    monkeypatch.setattr(search, "_larger", larger)
    monkeypatch.setattr(search, "prune", lambda s, _data: s if s in lasting else BASE)
    monkeypatch.setattr(search, "_hidden", lambda *_: None)
    judged = SimpleNamespace(largest=5.0, threshold=4.0)
    assert search._lasting(BASE, judged, None, (), {frozenset()}) is found


def test_what_noise_hides_is_tried_where_nothing_that_passes_lasts(monkeypatch):
    monkeypatch.setattr(search, "_larger", lambda *_: None)
    monkeypatch.setattr(search, "_hidden", lambda *_: LAG)
    monkeypatch.setattr(search, "prune", lambda s, _data: s)
    assert search._lasting(BASE, SimpleNamespace(largest=5.0, threshold=4.0), None, (), {frozenset()}) is LAG


def test_what_noise_hides_is_tried_once(monkeypatch):
    monkeypatch.setattr(search, "_hidden", lambda *_: LAG)
    monkeypatch.setattr(search, "prune", lambda s, _data: BASE)
    assert search._lasting(BASE, SimpleNamespace(largest=3.0, threshold=4.0), None, (), {frozenset()}) is None


@pytest.mark.parametrize(
    ("exchanged", "pruned", "kept"),
    [
        (state("a", "c"), state("c"), state("c")),  # what was beside it became superfluous
        (state("a", "c"), state("a"), state("a", "b")),  # what came in the place of b is dropped again
    ],
)
def test_an_exchange_that_is_dropped_again_is_none(monkeypatch, exchanged, pruned, kept):
    monkeypatch.setattr(diagnosing, "swap_tests", lambda *_: (exchanged, {"c": None}))
    monkeypatch.setattr(diagnosing, "prune", lambda *_: pruned)
    monkeypatch.setattr(diagnosing, "within_samples", lambda found, _data: found)
    after, standing = diagnosing._settled(SimpleNamespace(after=state("a", "b"), data=None, terms=()))
    assert after.fit.model.terms == kept.fit.model.terms
    assert standing is None
