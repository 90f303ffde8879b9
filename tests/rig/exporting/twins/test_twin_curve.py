"""The curve of a twin is its equations', its band the covariance's, its lag the nearest; the stand is left out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.twin import Twin, TwinLine, TwinNoise, TwinTerm, names_of
from rig.cli import main
from rig.errors import TwinError
from rig.exporting.twins import uuv
from rig.exporting.twins.curve import POINTS, curve_of
from rig.exporting.twins.written import Asked, head
from rig.twin.writing import write_twin
from tests.rig.exporting.twins.conftest import SCALE, STD, a_twin, by_hand


@pytest.fixture(scope="module")
def curve():
    return curve_of(a_twin(inflow=0.0))


def test_thrust_is_that_of_the_equations(curve):
    assert curve.driver.size == curve.thrust.size == POINTS
    assert curve.driver[POINTS // 2] == curve.thrust[POINTS // 2] == 0.0
    assert curve.thrust == pytest.approx(by_hand(curve.driver), abs=1e-6)
    assert curve.wanted == pytest.approx(by_hand(curve.commands), abs=1e-6)
    assert curve.rates == pytest.approx(1.9 * np.sign(curve.driver) * np.maximum(np.abs(curve.driver) - 0.9, 0.0))


def test_the_band_is_that_of_the_covariance(curve):
    n = np.maximum(np.abs(curve.driver) - 0.9, 0.0)
    ratio = np.where(curve.driver < 0, 0.78, 1.0)
    parts = [
        STD["C"] * n**2 * ratio,
        STD["dead_band.half_width"] * 2 * 0.3 * n * ratio,
        STD["asymmetry.ratio"] * 0.3 * n**2 * (curve.driver < 0),
    ]
    away = n > 0.5  # where a threshold that is moved a little meets no level
    wanted = 1.96 * np.sqrt(np.sum(np.square(parts), axis=0))
    assert curve.half_width[away] == pytest.approx(wanted[away], rel=0.25)


def test_a_lag_that_is_alone_is_found(curve):
    """Near the rotor's own: consumers lag what comes before the dead band, the rotor what comes after."""
    assert curve.lag == pytest.approx(0.12, rel=0.05)
    assert curve.lag_misses < 0.05 * curve.without_lag


def test_what_acts_in_the_stand_is_told_and_left_out(curve):
    assert [each.split(":")[0] for each in curve.left_out] == ["load_cell_nonlinearity"]
    line = TwinLine(0.3, 0.01, 7.0, 0.01)
    assert "a line at 7 Hz (0.3 N)" in curve_of(replace(a_twin(), lines=(line,))).left_out


def test_thrust_that_follows_the_measured_rate_follows_the_one_that_the_twin_foretells():
    """As a bench's own twin has it: all of the thrust goes with n, and the command tells n."""
    coupled = TwinTerm("rotation_coupling", "", {"share": 1.0}, SCALE)
    lag = TwinTerm("motor_lag", "first_order", {"time_constant": 0.12}, SCALE)
    alone = Twin(
        "T1", "command_voltage", 0.3, (lag, coupled), names_of((lag, coupled)), ((0.0,) * 3,) * 3, TwinNoise(0.02, 0.0),
        (), 0.02, 16.0, 1.9, 1.9,
    )  # fmt: skip
    curve = curve_of(alone)
    assert curve.thrust == pytest.approx(0.3 * curve.driver * np.abs(curve.driver), rel=2e-3, abs=1e-3)
    assert curve.lag == pytest.approx(0.12, rel=0.1)
    without = curve_of(replace(alone, rate_per_driver=None))
    assert without.left_out[0].startswith("rotation_coupling: as at its reference")


def test_a_consumer_of_rates_wants_a_twin_that_knows_them(tmp_path, capsys):
    write_twin(a_twin(rate=None), tmp_path / "t.json")
    assert main(["export", str(tmp_path / "t.json"), "--to", "mss"]) == 2
    assert "record rotation_rate" in capsys.readouterr().err
    assert not list(tmp_path.glob("*mss*"))
    assert main(["export", str(tmp_path / "t.json"), "--to", "gz-sim"]) == 0


@pytest.mark.parametrize(
    ("change", "said"), [({"highest_driver": 0.0}, "how large its driver"), ({"C": 0.0}, "same thrust at every level")]
)
def test_a_twin_that_is_no_thruster_is_refused(change, said):
    with pytest.raises(TwinError, match=said):
        curve_of(replace(a_twin(), **change))


def test_the_wrong_kind_of_target_is_one_sentence(twin_file, capsys):
    assert main(["export", str(twin_file), "--to", "parquet"]) == 2
    said = capsys.readouterr().err
    assert "this takes a recording" in said
    assert "stonefish" in said
    assert main(["export", str(twin_file), "--to", "table", "--pulse", "1900", "1500", "1100"]) == 2
    assert main(["export", str(twin_file), "--to", "table", "--streams", "x"]) == 2


def test_a_name_is_one_that_every_language_takes():
    asked = Asked(a_twin(), replace(curve_of(a_twin()), thruster="2 bow/*"), "x")
    assert asked.name == "thruster_2_bow__"
    assert "2 bow/*" in head(asked, uuv.carried(asked))[0]
