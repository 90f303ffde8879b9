"""Rows that are lost, come twice or too fast, by windows of constructed rows."""

import random

import pytest

from rig.safety.row_spacing import RowSpacing

PERIOD = 1 / 92


def first_trip(rows, until: float = 6.0):
    """(s, cause) of rows (s, value)."""
    spacing, rows = RowSpacing("cell", PERIOD, 1.0, 0.0), list(rows)
    for tick in range(round(until / 0.02)):
        now = tick * 0.02
        while rows and rows[0][0] <= now:
            spacing.add(rows[0][0], (rows[0][1],))
            rows.pop(0)
        trip = spacing.advance(now)
        if trip:
            return now, trip.cause
    return None


def noisy(period: float = PERIOD, until: float = 6.0, seed: int = 1):
    chance = random.Random(seed)
    return [(i * period, chance.gauss(0, 1)) for i in range(round(until / period))]


def batched(rows, every: float):
    """As an adapter hands them over: together."""
    return [((int(t / every) + 1) * every, value) for t, value in rows]


@pytest.mark.parametrize(
    "rows",
    [
        noisy(),
        noisy(PERIOD * 0.9),
        noisy(PERIOD * 1.1),
        noisy(PERIOD * 1.7),
        batched(noisy(), 0.016),
        [(t, 3.0) for t, _ in noisy()],
        [(2.4 if 2.0 <= t < 2.4 else t, value) for t, value in noisy()],
    ],
    ids=["plain", "faster clock", "slower clock", "slow", "batched", "coarse digit", "machine stood still"],
)
def test_sound_rows_pass(rows):
    assert first_trip(rows) is None


@pytest.mark.parametrize("share", [0.1, 0.3])
def test_lost_rows(share):
    chance = random.Random(2)
    now, cause = first_trip([row for row in noisy() if chance.random() >= share]) or (9.0, "")
    assert now <= 2.1
    assert "of its rows are missing, 5% are allowed" in cause


def test_rows_that_come_twice():
    chance = random.Random(2)
    twice = [(t + late, value) for t, value in noisy() for late in ((0, 0.0047) if chance.random() < 0.1 else (0,))]
    now, cause = first_trip(twice) or (9.0, "")
    assert now <= 2.1
    assert "of its rows came twice" in cause


def test_rows_that_come_2_3_times_too_fast():
    now, cause = first_trip(noisy(PERIOD / 2.3)) or (9.0, "")
    assert now <= 2.1
    assert "212 rows/s for 2 windows, at most 138 are expected" in cause


def test_a_single_window_is_chance():
    chance = random.Random(2)
    assert first_trip([row for row in noisy() if not (1.2 < row[0] < 1.9 and chance.random() < 0.3)]) is None
