"""`rig vehicle` on files: what a person reads, what a program reads, and the sentence for what cannot be used."""

import copy
import json

import pytest
from click.testing import CliRunner

from rig.vehicle.command import vehicle_command
from tests.rig.vehicle_files import LAY_OUT, documents, fit_of, write

ETA = {"eta_hull": 0.7, "eta_pair": 0.85}


@pytest.fixture(scope="module")
def made():
    return documents()


@pytest.fixture(scope="module")
def files(made, tmp_path_factory):
    folder = tmp_path_factory.mktemp("vehicle")
    (folder / "installation.toml").write_text(LAY_OUT)
    fit_of(folder / "fit.json")
    return {name: write(folder, name, one) for name, one in made.items()} | {"folder": folder}


def run(files, *names, thrusters="fit.json", lay_out="installation.toml", more=()):
    folder = files["folder"]
    paths = [str(files.get(name, name)) for name in names]
    options = ["--thrusters", str(folder / thrusters)] if thrusters else []
    options += ["--installation", str(folder / lay_out)] if lay_out else []
    return CliRunner().invoke(vehicle_command, [*paths, *options, *map(str, more)])


def refused(result, *said):
    assert result.exit_code == 2, result.output
    lines = result.output.strip().splitlines()
    assert len(lines) == 1
    for text in said:
        assert text in lines[0]


@pytest.fixture(scope="module")
def whole(files):
    out = files["folder"] / "answer.json"
    result = run(
        files, "front", "all", "sine", more=("--json", out, "--holdout", files["check"], "--comparators")
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    return result.output, json.loads(out.read_text(), parse_constant=lambda word: pytest.fail(word))


def test_parameters_are_found_within_their_intervals(whole):
    _, answer = whole
    assert (answer["format"], answer["version"], answer["vehicle"]) == ("thruster-rig-vehicle", 1, "small ROMEO")
    surge = answer["axes"]["surge"]
    for name, truth in ({"m": 800.0, "k": 60.0, "k2": 420.0} | ETA).items():
        p = surge["parameters"][name]
        assert abs(p["value"] - truth) < 4 * p["std"], name
        assert p["interval_95"][0] < p["value"] < p["interval_95"][1]
    assert surge["parameters"]["m"]["unit"] == "kg"
    assert set(surge["drag"]["parameters"]) == {"k", "k2", "eta_hull", "eta_pair"}
    assert len(surge["drag"]["runs"]) == 12
    assert surge["inertia"]["method"] == "output error"
    assert len(surge["covariance"]["matrix"]) == len(surge["covariance"]["names"])
    assert {one["recording"] for one in surge["simulation"]} == {"front", "all", "sine"}
    assert [(r["name"], r["step"]) for r in answer["recordings"]] == [
        ("front", "steady"), ("all", "steady"), ("sine", "moving"),
    ]  # fmt: skip


def test_efficiencies_are_what_a_held_out_run_needs(whole):
    text, answer = whole
    (check,) = answer["held_out"]
    assert check["with_efficiency"]["rmse"] < 0.2
    assert check["without_efficiency"]["rmse"] > 1.0
    assert "without efficiencies" in text


def test_other_ways_to_the_inertia_stand_beside_ours(whole):
    text, answer = whole
    ways = answer["axes"]["surge"]["comparators"]
    assert len(ways) == 3
    for way in ways:
        m = way["parameters"]["m"]
        assert abs(m["value"] - 800.0) < 5 * m["std"]
    assert "extended Kalman filter" in text
    assert "70 % of the calibrated thrust" in text


def test_without_a_sine_the_drag_is_still_said(files):
    result = run(files, "front", "all", more=("--json", "-"))
    assert result.exit_code == 0
    surge = json.loads(result.output)["axes"]["surge"]
    assert "no sine-force trial was given" in surge["inertia"]["reason"]
    assert surge["parameters"]["k"]["determined"]
    assert surge["simulation"] == []
    assert "no sine-force trial" in run(files, "front", "all").output


def test_runs_of_one_speed_only_say_what_they_cannot_tell(files):
    result = run(files, "one")
    assert result.exit_code == 0
    assert "cannot tell the combination" in result.output
    assert "not determined" in result.output


def test_without_an_installation_thrusters_push_straight_ahead(files):
    result = run(files, "front", "sine", lay_out=None)
    assert result.exit_code == 0, result.output
    assert "no installation file: each thruster is taken to push straight ahead" in result.output


def changed(files, made, name, change):
    """The file of a trial with something wrong with it."""
    document = copy.deepcopy(made["front"])
    change(document)
    return write(files["folder"], name, document)


def holes(document, share):
    value = document["streams"]["acoustic"]["channels"]["surge"]["value"]
    value[: int(share * len(value))] = [None] * int(share * len(value))


def test_a_gap_in_the_positions_is_noted(files, made):
    path = changed(files, made, "gap", lambda d: holes(d, 0.05))
    result = run(files, path, "all")
    assert result.exit_code == 0
    assert "values of surge are missing" in result.output


@pytest.mark.parametrize(
    ("name", "change", "said"),
    [
        ("nothing", lambda d: holes(d, 1.0), "values of surge are missing"),
        ("no-motion", lambda d: d["streams"].pop("acoustic"), "has no position, depth, heading or speed of that axis"),
        ("no-command", lambda d: d["streams"].pop("command"), "has no command_voltage"),
        ("tunnel", lambda d: d["attributes"].update(kind="tunnel"), "not one of a vehicle"),
        (
            "lost",
            lambda d: d["streams"]["command"]["channels"]["command_T1"]["value"].__setitem__(2, None),
            "the force is not known there",
        ),
        (
            "constant",
            lambda d: d["steps"].__delitem__(slice(2, None)),
            "1 constant-velocity run(s)",
        ),
        (
            "still",
            lambda d: [c.update(value=[0.0] * len(c["value"])) for c in d["streams"]["command"]["channels"].values()],
            "0 V throughout",
        ),
        (
            "stranger",
            lambda d: d["streams"]["command"]["channels"]["command_T1"].update(thruster="T9"),
            "commands thruster 'T9', which the installation does not have",
        ),
    ],
)
def test_recordings_that_cannot_be_used(files, made, name, change, said):
    refused(run(files, changed(files, made, name, change)), said)


def test_the_same_file_twice_and_a_fitted_one_held_out(files):
    refused(run(files, "front", "front"), "the same recording", "give it once")
    refused(run(files, "front", "all", "sine", more=("--holdout", files["front"])), "give it once")


def test_a_folder_without_recordings(files, tmp_path):
    refused(run(files, tmp_path), "folder without recordings")
    refused(run(files, tmp_path / "no.h5"), "no.h5")


def test_fits_of_other_thrusters_and_no_fits(files):
    folder = files["folder"]
    fit_of(folder / "others.json", ("P1", "P2"))
    refused(run(files, "front", thrusters="others.json"), "needs a fit of 'T1'", "P1, P2")
    refused(run(files, "front", thrusters=None), "--thrusters was not given")
    refused(run(files, "front", thrusters="missing.json"), "there is no such file", "rig fit")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{", "not JSON of `rig fit --json`"),
        ('{"format": "x"}', "expected 'thruster-rig-fit'"),
        ('{"format": "thruster-rig-fit", "version": 9}', "version 9"),
        ('{"format": "thruster-rig-fit", "version": 1, "fits": []}', "holds no fit"),
        ('{"format": "thruster-rig-fit", "version": 1, "fits": [{"model": "C V|V|"}]}', "not as `rig fit --json`"),
        (
            '{"format": "thruster-rig-fit", "version": 1, "fits": [{"thruster": "T1", "model": "C_t n|n|"}]}',
            "vehicle trials know the command voltage",
        ),
    ],
)
def test_thruster_files_that_cannot_be_used(files, text, said):
    (files["folder"] / "wrong.json").write_text(text)
    refused(run(files, "front", thrusters="wrong.json"), said)


def test_a_coefficient_that_was_not_determined_and_a_thruster_fitted_twice(files):
    folder = files["folder"]
    fit_of(folder / "null.json", value=None)
    refused(run(files, "front", thrusters="null.json"), "C of thruster T1 is not determined")
    refused(run(files, "front", more=("--thrusters", folder / "fit.json")), "give one fit of each")


def test_both_directions_of_a_thruster(files):
    fit_of(files["folder"] / "both.json", model="C+/C-", std_statistical=None)
    result = run(files, "front", "all", thrusters="both.json", more=("--json", "-"))
    assert result.exit_code == 0, result.output
    assert "C+[T1]" in json.loads(result.output)["axes"]["surge"]["drag"]["thrusters"]


def test_an_axis_with_drag_alone_has_nothing_to_hold_out(files):
    result = run(files, "front", "all", more=("--holdout", files["check"]))
    refused(result, "drives surge, of which drag and inertia were not both identified")


def test_an_answer_that_cannot_be_written(files, tmp_path):
    result = run(files, "front", "all", more=("--json", tmp_path / "no" / "where.json"))
    assert result.exit_code == 2
