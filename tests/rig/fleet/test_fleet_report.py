"""`rig fleet PAGE`: who left the limits, since when, and what they hide, from the fits in a store."""

import json

import pytest
from click.testing import CliRunner
from matplotlib.figure import Figure

from rig.fit.command import fit_command
from rig.fleet_report.command import fleet_command
from rig.fleet_report.departures import departures_of, to_diagnose
from rig.fleet_report.figures_of_units import charts_of
from rig.fleet_report.page import FleetReport, fleet_page, lead
from rig.fleet_report.pictures import VAGUE, picture
from rig.fleet_report.units import units_of
from rig.report.page import html
from tests.rig.fleet.small_recordings import folder, write


def rig(command, *arguments):
    return CliRunner().invoke(command, [str(each) for each in arguments], catch_exceptions=False)


def fitted(number, C=0.4, **more):
    """A row as a fit leaves it; units differ by 1 %, in a pattern."""
    C *= 1.0 + 0.01 * [0.0, 1.2, -0.8, 0.3, -1.1, 0.7, -0.2][number % 7]
    row = {
        "thruster": f"T-{number:05}",
        "serial": number,
        "recording_id": f"id-{number}",
        "created": f"2026-11-{1 + number // 20:02}T10:00:00+00:00",
        "url": f"/line/{number}.h5",
        "sha256": f"{number:064}",
        "asked": "a",
        "options": "{}",
        "opened_as": "plain",
        "error": None,
        "C": C,
        "C_std_statistical": 0.0004,
        "C_std_calibration": 0.0008,
        "asymmetry": 0.01,
        "asymmetry_std": 0.001,
        "rmse": 0.2 * C,
        "settling_time": 0.08 + 0.001 * (number % 5),
        "settling_time_std": 0.0005,
        "calibration": "cell",
    }
    return row | more


@pytest.fixture
def rows():
    found = [fitted(k) for k in range(200)]
    found[33] = fitted(33, C=0.3)
    found[90] = fitted(90, settling_time=0.2)
    found[120:160] = [fitted(k, C=0.4 * 0.97) for k in range(120, 160)]
    return found


def test_units_are_in_order_and_each_recording_once(rows):
    copy = rows[5] | {"opened_as": "recovered", "url": "/a", "C": 9.0}
    broken = {"error": "no thrust", "asked": "a", "options": "{}", "url": "/b"}
    other = rows[6] | {"asked": "b", "options": '{"model": "other"}'}
    units = units_of([*reversed(rows), copy, broken, other])
    assert [row["serial"] for row in units.rows] == list(range(200))
    assert (units.rows[5]["C"], units.twice) == (rows[5]["C"], 1)
    assert (len(units.without), units.aside) == (1, {'{"model": "other"}': 1})


def test_who_left_the_limits_and_since_when(rows):
    found = departures_of(charts_of(rows))
    assert {each.place: each.off[0][0] for each in found.alone} == {33: "C", 90: "settling"}
    (stretch,) = found.together
    assert stretch.charted.figure.name == "C"
    assert abs(stretch.places[0] - 120) <= 3
    assert abs(stretch.places[-1] - 159) <= 3
    assert stretch.size == pytest.approx(-3.0, abs=0.5)


@pytest.mark.parametrize(("std", "told"), [(0.001, False), (0.1, True)])
def test_a_unit_beyond_the_lines_that_is_known_no_better_has_its_own_limits_as_a_bar(rows, std, told):
    rows[50] = fitted(50, asymmetry=0.2, asymmetry_std=std)
    charted = next(each for each in charts_of(rows) if each.figure.name == "asymmetry")
    assert charted.chart.outside[50] != told
    figure = Figure()
    picture(charted, rows).plot.draw(figure)
    assert (VAGUE in [text.get_text() for text in figure.axes[0].get_legend().texts]) == told


def test_who_is_diagnosed(rows):
    charts = charts_of(rows)
    places = to_diagnose(rows, charts, departures_of(charts), 10)
    assert {33, 90} <= set(places)
    assert sum(120 <= place < 160 for place in places) == 2
    assert sum(place not in range(120, 160) and place not in (33, 90) for place in places) == 1, "and a usual one"
    assert to_diagnose(rows, charts, departures_of(charts), 0) == ()


def test_a_sound_fleet_and_a_small_one(rows):
    from rig.fleet_report.answers import Diagnosed

    sound = [fitted(k) for k in range(100)]
    charts = charts_of(sound)
    told = FleetReport(units_of(sound), charts, departures_of(charts), Diagnosed({}))
    assert lead(told) == "100 units: none left its limits alone, and no stretch of the production is off."
    small = FleetReport(units_of(sound[:5]), charts_of(sound[:5]), departures_of(()), Diagnosed({}))
    assert "charts need 20" in lead(small)
    assert "No unit is outside" in html(fleet_page(small))


def test_from_files_to_a_page_with_a_diagnosis(tmp_path):
    root, store = folder(tmp_path / "line", 24), tmp_path / "store"
    write(root / "odd.h5", 24, C=0.3)
    (root / "torn.h5").write_bytes((root / "0.h5").read_bytes()[:3000])
    assert rig(fit_command, root, "--jobs", 2, "--store", store).exit_code == 1
    page, found = tmp_path / "page.html", tmp_path / "found.json"
    asked = (page, "--store", store, "--json", found, "--sigmas", 6)
    told = rig(fleet_command, *asked)
    assert told.exit_code == 0, told.output
    assert "25 units: 1 unit left the limits alone" in told.output
    known = json.loads(found.read_text())
    (odd,) = known["alone"]
    assert (odd["thruster"], odd["off"][0]["figure"]) == ("T-00024", "C")
    assert [f["effect"] for f in odd["diagnosis"]["findings"]] == ["thrust_constant"]
    assert "torn.h5" in known["without_fit"][0]["url"]
    text = page.read_text()
    assert odd["diagnosis"]["statement"][:40] in text
    assert known["usual"] in text
    begun = store / "usual"
    before = {path: path.stat().st_mtime_ns for path in begun.iterdir()}
    again = rig(fleet_command, *asked)
    assert again.exit_code == 0
    assert {path: path.stat().st_mtime_ns for path in begun.iterdir()} == before, "nobody is diagnosed twice"


def test_a_store_without_fits_says_what_makes_them(tmp_path):
    told = rig(fleet_command, tmp_path / "page.html", "--store", tmp_path / "none")
    assert (told.exit_code, "rig fit FILES --jobs 2" in told.output) == (2, True)
