"""A periodic disturbance in the answer, in a twin and in what the twin predicts."""

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.answer.as_json import diagnosis_json
from identification.mismatch.compare.simulation import Drive, simulate, wave_notes
from identification.mismatch.periodic.rotor_angle import turned
from identification.mismatch.pipeline import diagnose
from identification.recording import Channel, Recording
from identification.watching.known import expected_of
from rig.twin.reading import read_twin
from rig.twin.writing import twin_json, write_twin
from tests.identification.diagnosed_runs import NOISE, C, levels, run

SECONDS, HUM = 120.0, 7.3


def hum(amplitude=0.3, phase=1.0):
    return lambda t, _V, F: F + amplitude * np.sin(2 * np.pi * HUM * t + phase)


@pytest.fixture(scope="module")
def hummed():
    return diagnose([run(hum(), seconds=SECONDS)])


@pytest.fixture(scope="module")
def twin(hummed, tmp_path_factory):
    path = tmp_path_factory.mktemp("twin") / "T1.twin.json"
    write_twin(hummed.twin, path)
    return read_twin(path)


def test_a_line_is_a_place_with_its_frequency(hummed):
    (place,) = diagnosis_json(hummed)["mismatch"]
    assert place["where"]["quantity"] == "frequency"
    assert place["where"]["unit"] == "Hz"
    assert place["where"]["from"] < HUM < place["where"]["to"]
    assert place["where"]["to"] - place["where"]["from"] == pytest.approx(2 / SECONDS, rel=0.01)
    assert place["share"] == pytest.approx(0.045 / (0.045 + NOISE**2), rel=0.1)


def test_its_numbers_are_parameters_of_the_model(hummed):
    said = diagnosis_json(hummed)
    assert said["model"]["terms"] == ["periodic_disturbance"]
    (finding,) = said["findings"]
    own = {name: said["model"]["parameters"][f"periodic_disturbance.{name}"] for name in finding["parameters"]}
    assert own == finding["parameters"]
    assert set(own) == {"amplitude", "frequency", "phase"}
    assert finding["rivals"] == []


def test_a_twin_file_keeps_it_and_says_by_its_version_that_it_does(hummed, twin):
    assert replace(twin, origin=hummed.twin.origin) == hummed.twin
    assert twin_json(twin)["version"] == 2
    assert twin_json(replace(twin, lines=()))["version"] == 1


def test_what_the_twin_predicts_has_it_with_its_phase(twin):
    quiet = run(hum(), seconds=SECONDS, noise=0.0)
    thrust, command = quiet.first_of("thrust"), quiet.first_of("command_voltage")
    found = simulate(twin, Drive(command.time, command.value), thrust.time)
    assert np.std(thrust.value - found.thrust) < 0.05
    assert wave_notes(twin) == ("A line of 0.306 N at 7.3 Hz is in it (phase of the first recording's clock).",)


def test_a_watch_s_expectation_of_a_hold_has_no_wave(twin):
    assert expected_of(twin)(10.0, np.nan, 0.0, np.nan) == pytest.approx(100 * twin.C, rel=1e-6)


def test_against_the_twin_the_same_line_is_no_finding_whatever_its_phase(twin):
    found = diagnose([run(hum(phase=2.5), seed=4, seconds=SECONDS)], baseline=twin)
    assert (found.verdict, found.findings, found.mismatch) == ("adequate", (), ())
    assert found.model_terms == ("periodic_disturbance",)
    assert len(found.twin.lines) == 1
    assert found.baseline["periodic_disturbance.frequency"].value == pytest.approx(HUM, rel=1e-4)


def test_a_line_that_grew_and_one_that_went_are_told(twin):
    grown = diagnose([run(hum(0.6), seed=4, seconds=SECONDS)], baseline=twin)
    (finding,) = grown.findings
    assert "where the twin T1.twin.json has 0.306 N" in finding.statement
    gone = diagnose([run(seed=4, seconds=SECONDS)], baseline=twin)
    assert gone.verdict == "adequate"
    assert gone.notes == ("the twin T1.twin.json has a line at 7.3 Hz, not found here.",)
    assert gone.twin.lines == twin.lines


# ---------------------------------------------------------------- with the rotor, or at a frequency


def both_ways(size=8.0, seed=0, amplitude=0.4):
    """One level, forward and in reverse, with a wave of 3 periods a turn; the rotor turns at 0.7 rev/s per V."""
    rng = np.random.default_rng(seed)
    start = np.arange(0.0, SECONDS, 6.0) + 0.003
    level = size * np.where(np.arange(start.size) % 2, -1.0, 1.0)
    t = np.arange(0.02, SECONDS, 1 / 60)
    V = level[np.maximum(np.searchsorted(start, t, side="right") - 1, 0)]
    wave = amplitude * np.sin(2 * np.pi * 3 * 0.7 * size * t)
    channels = (
        Channel("command_voltage", "command", "command_voltage", "V", start, level),
        Channel("thrust", "cell", "thrust", "N", t, C * V * np.abs(V) + wave + NOISE * rng.standard_normal(t.size)),
        Channel("rotation_rate", "motor", "rotation_rate", "rev/s", t, 0.7 * V),
    )
    return Recording("both-ways", "T1", channels, source="both-ways.h5")


def test_at_one_speed_a_line_may_stay_or_go_with_the_rotor_and_both_are_told():
    found = diagnose([both_ways()])
    said = diagnosis_json(found)
    (finding,) = said["findings"]
    assert finding["rivals"] == ["periodic_disturbance"]
    (rival,) = finding["rival_details"]
    assert {finding["form"], rival["form"]} == {"fixed", "rotation"}
    assert rival["parameters"]["frequency"]["value"] == pytest.approx(finding["parameters"]["frequency"]["value"], 1e-3)
    assert finding["probability"] == pytest.approx(0.5, abs=0.4)
    assert said["verdict"] == "ambiguous"
    assert "16.8 Hz. Instead of periodic disturbance it may be" in said["statement"]
    assert "(rotation)" in said["statement"]
    levels_ = {step["command_voltage"] for step in said["next_experiment"]["steps"]}
    assert len(levels_ - {0.0}) == 2
    assert said["next_experiment"]["expected_power"] > 0.9


@pytest.fixture(scope="module")
def blades():
    """Three periods a turn at levels of many speeds; the rate is read so often that the angle is known across steps."""
    start, level = levels(0, SECONDS)
    t = np.arange(0.0, SECONDS, 1 / 60)
    V = level[np.maximum(np.searchsorted(start, t, side="right") - 1, 0)]
    turns = turned(np.append(start, SECONDS), 0.7 * level, t)
    wave = np.where(V == 0, 0.0, 0.5 * np.sin(2 * np.pi * 3 * turns))
    often = np.arange(0.0, SECONDS, 1 / 600)
    turning = 0.7 * level[np.maximum(np.searchsorted(start, often, side="right") - 1, 0)]
    rate = Channel("rotation_rate", "motor", "rotation_rate", "rev/s", often, turning)
    return diagnose([run(lambda *each: each[2] + wave, seconds=SECONDS, rate=60.0, extra=(rate,))])


def test_a_line_that_goes_with_the_rotor_is_placed_over_all_its_frequencies(blades):
    (finding,) = blades.findings
    assert (finding.form, finding.rivals) == ("rotation", ())
    (place,) = [m.where for m in blades.mismatch if m.where.quantity == "frequency"]
    assert place.low == pytest.approx(3 * 0.7 * 2.0, abs=0.1)
    assert place.high == pytest.approx(3 * 0.7 * 12.0, abs=0.1)


def test_it_is_predicted_with_the_model_s_turns_and_silent_at_rest(blades):
    time = np.arange(0.0, 20.0, 0.005)
    found = simulate(blades.twin, Drive(np.array([0.0, 10.0]), np.array([5.0, 0.0])), time)
    turning = (time > 1.0) & (time < 9.9)
    wave = found.thrust[turning] - found.thrust[turning].mean()
    power = np.abs(np.fft.rfft(wave * np.hanning(wave.size)))
    peak = np.fft.rfftfreq(wave.size, 0.005)[np.argmax(power)]
    assert peak == pytest.approx(3 * 0.7 * 5.0, rel=0.01)
    assert np.sqrt(2) * wave.std() == pytest.approx(0.5, rel=0.1)
    assert np.all(found.thrust[time > 10.1] == 0.0)
