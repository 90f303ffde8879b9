"""Which unit explains a factor, and what is said of a run that is wired otherwise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import constants

from identification.mismatch import policy
from identification.mismatch.faults.between_runs import Differs
from identification.mismatch.faults.comparison_of_runs import Changed
from identification.mismatch.faults.wiring_words import CHECK, UNITS, Unit, name_of, said, unit_of
from identification.recording import Recording

MINE = Recording("id-2", "T1", (), source="second.csv")
OTHER = Recording("id-1", "T1", (), source="first.csv")
RESCALED = Changed("rescaled", "thrust", 1e-9, factor=0.3, error=0.01, by=("current", "rotation_rate"))

ONE = {
    "lbf": constants.pound_force,
    "kgf": constants.kilogram_force,
    "gf": constants.kilogram_force / 1000,
    "mN": constants.milli,
    "kN": constants.kilo,
    "rpm": 1 / constants.minute,
    "rad/s": 1 / (2 * constants.pi),
    "deg/s": constants.degree / (2 * constants.pi),
    "mA": constants.milli,
    "mV": constants.milli,
    "N.mm": constants.milli,
    "N.cm": constants.centi,
    "kgf.cm": constants.kilogram_force * constants.centi,
    "lbf.in": constants.pound_force * constants.inch,
    "lbf.ft": constants.pound_force * constants.foot,
}
"""Of each unit, in N, rev/s, A, V or N.m."""
OTHERWISE = {"mN": "kN", "kN": "mN"}
"""What was converted twice from the one may be the other, left as it was: that is told."""
EVERY = [(channel, name) for channel, units in UNITS.items() for name in units]


@pytest.mark.parametrize(("channel", "name"), EVERY)
def test_a_figure_in_another_unit_is_known_by_its_factor_and_by_that_turned_round(channel: str, name: str) -> None:
    size = 1 / ONE[name]
    assert unit_of(Changed("rescaled", channel, 1e-9, factor=size)) == Unit(name, pytest.approx(size, rel=1e-8), False)
    turned = unit_of(Changed("rescaled", channel, 1e-9, factor=1 / size))
    assert turned == Unit(OTHERWISE.get(name, name), pytest.approx(1 / size, rel=1e-8), name not in OTHERWISE)


def test_a_factor_beside_every_unit_is_none_and_only_a_rescaled_channel_has_one() -> None:
    off = float(np.exp(1.1 * policy.faults.UNIT_BETWEEN_RUNS))
    pound = replace(RESCALED, factor=1 / constants.pound_force)
    assert unit_of(replace(pound, factor=pound.factor / off)) is None
    assert unit_of(replace(pound, factor=pound.factor / off**0.8)) is not None
    assert unit_of(replace(pound, kind="driver")) is None
    assert unit_of(replace(pound, channel="flow_speed")) is None


def test_a_run_goes_by_its_file_or_else_by_its_id() -> None:
    assert name_of(MINE) == "second.csv"
    assert name_of(replace(MINE, source="")) == "id-2"


CHANGES = {
    "swapped": Changed("swapped", "thrust", 1e-9, other="current", factor=1.02, by=("rotation_rate",)),
    "reversed": Changed("reversed", "thrust", 1e-9, factor=-1.0, by=("current",)),
    "rescaled": RESCALED,
    "driver": Changed("driver", "command_voltage", 1e-9, factor=0.8, by=("thrust", "current")),
    "strange": Changed("strange", "thrust", 1e-9, by=("current",)),
}


def test_each_kind_of_change_has_something_to_check() -> None:
    assert set(CHANGES) == set(CHECK)


@pytest.mark.parametrize("kind", CHANGES)
def test_a_sentence_begins_with_the_file_and_ends_with_what_to_check_there(kind: str) -> None:
    text = said(Differs(MINE, CHANGES[kind], OTHER, 3))
    assert text.startswith("second.csv: ")
    assert text.endswith(f"; {CHECK[CHANGES[kind].kind].format(run='second.csv')}.")
    assert "the other runs" in text
    assert "first.csv" not in text
    assert "{" not in text


@pytest.mark.parametrize("kind", CHANGES)
def test_of_two_runs_the_other_is_named_and_so_is_the_doubt(kind: str) -> None:
    doubt = "or in first.csv: of two runs nobody knows which is the right one."
    unknown = said(Differs(MINE, CHANGES[kind], OTHER, 2, known=False))
    assert unknown.endswith(doubt)
    assert "the other runs" not in unknown
    assert doubt not in said(Differs(MINE, CHANGES[kind], OTHER, 2, known=True))


def test_figures_are_those_of_the_change() -> None:
    assert "exchanged: put back, they go together with rotation_rate as in the other runs (to 2 %)" in said(
        Differs(MINE, CHANGES["swapped"], OTHER, 3)
    )
    assert "gives what 1.25 times it gives" in said(Differs(MINE, CHANGES["driver"], OTHER, 3))
    assert "thrust is 0.3 times what current, rotation_rate let expect" in said(Differs(MINE, RESCALED, OTHER, 3))


def test_a_unit_takes_the_place_of_a_calibration() -> None:
    told = said(Differs(MINE, replace(RESCALED, factor=1 / constants.pound_force), OTHER, 3))
    assert "it is in lbf, told as N" in told
    assert told.endswith("; check the unit of that column in second.csv.")
    twice = said(Differs(MINE, replace(RESCALED, factor=constants.pound_force), OTHER, 3))
    assert "converted from lbf to N once more than needed" in twice


def test_what_no_third_channel_tells_is_said() -> None:
    unsure = replace(CHANGES["strange"], sure=False)
    assert "no third channel tells which lies" in said(Differs(MINE, unsure, OTHER, 3))
    assert "no third channel tells whether it is thrust" in said(Differs(MINE, replace(RESCALED, sure=False), OTHER, 3))
