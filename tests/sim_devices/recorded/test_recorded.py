"""Cases recorded on benches in virtual time: files that the rig reads, strengths as asked, seals apart."""

import json
import tomllib
from dataclasses import replace

import numpy as np
import pytest

from rig.campaign.loading import load_campaign
from rig.cli import record_in_virtual_time
from rig.hdf5.load import load
from sim_devices.concealed.cases.definition import Amplifier
from sim_devices.concealed.visibility.oracle import strength
from sim_devices.concealed.visibility.projection import amplified
from sim_devices.recorded.benches import BENCHES
from sim_devices.recorded.campaign import PLANS, bench_file, campaign_file
from sim_devices.recorded.draw import EFFECTS, drawn
from sim_devices.recorded.on_disc import conceal
from sim_devices.recorded.run import noises
from sim_devices.tables import WorldError


@pytest.mark.parametrize("on", BENCHES)
@pytest.mark.parametrize("plan", PLANS)
def test_the_rig_takes_what_it_is_told_of_a_bench(tmp_path, on, plan):
    made = drawn(np.random.default_rng(4), on, plan=plan, duration=90.0)
    (tmp_path / "bench.toml").write_text(bench_file(made.bench, made.case.scale), encoding="utf-8")
    (tmp_path / "campaign.toml").write_text(campaign_file(made.campaign, "T", made.case.scale), encoding="utf-8")
    campaign = load_campaign(tmp_path / "campaign.toml")
    planned = campaign.plan.duration().expected
    assert made.case.scale.duration == pytest.approx(planned, rel=0.1, abs=8.0), "strengths are found for this command"
    told = tomllib.loads((tmp_path / "bench.toml").read_text(encoding="utf-8"))["devices"]["load_cell"]
    assert told.get("window") == (1.0 / told["rate"] if made.bench.cell.average > 1 else None)
    assert told.get("delay", 0.0) == pytest.approx(made.bench.cell.filter_time)


def test_the_same_seed_is_the_same_case_and_a_mean_is_as_noisy_as_asked():
    one, same, other = (drawn(np.random.default_rng(seed), "balance") for seed in (7, 7, 8))
    assert one.bench == same.bench != other.bench
    assert one.campaign == same.campaign
    assert one.case.thruster == same.case.thruster
    assert noises(one)["thrust"].white == pytest.approx(one.case.noise.white * 250**0.5), "of 0.2 ms each"


def test_strengths_are_of_what_the_amplifier_lets_through():
    step, dt = np.where(np.arange(400) < 100, 0.0, 2.0), 0.001
    behind = amplified(step, dt, Amplifier(low_pass=0.02))
    assert behind[119] == pytest.approx(2.0 * (1.0 - np.exp(-1.0)), rel=0.01)
    mean = amplified(step, dt, Amplifier(window=0.05))
    assert mean[[99, 124, 149]] == pytest.approx([0.0, 1.0, 2.0], abs=0.05)
    assert amplified(step, dt, Amplifier()) == pytest.approx(step)
    made = drawn(np.random.default_rng(3), "balance", ["periodic_disturbance"], 40.0, "interleaved", 60.0).case
    assert made.amplifier.window == pytest.approx(0.05)
    assert strength(replace(made, amplifier=Amplifier(window=0.5)), "periodic_disturbance") < 30.0


def test_a_delay_is_larger_than_what_the_recording_does_not_know_of_one():
    for seed in range(3):
        (skew,) = drawn(np.random.default_rng(seed), "amplifier", ["time_skew"], 40.0, "interleaved", 60.0).case.effects
        assert skew.parameters["delay"] >= 0.01


def test_what_a_bench_cannot_show_is_refused():
    assert "speed_of_advance" not in EFFECTS
    with pytest.raises(ValueError, match="got speed_of_advance"):
        drawn(np.random.default_rng(1), "tunnel", ["speed_of_advance"])
    with pytest.raises(ValueError, match="bench must be one of tunnel, amplifier, balance"):
        drawn(np.random.default_rng(1), "river")
    with pytest.raises(ValueError, match="plan must be one of"):
        drawn(np.random.default_rng(1), "tunnel", plan="waltz")


def test_a_case_is_recorded_and_sealed(tmp_path):
    asked = {"token": "abc", "seed": [5], "bench": "amplifier", "effects": ["asymmetry"], "strength": 40.0}
    conceal(asked | {"plan": "interleaved", "duration": 40.0}, tmp_path, record_in_virtual_time)
    sealed = json.loads((tmp_path / "sealed" / "abc.json").read_text(encoding="utf-8"))
    (effect,) = sealed["effects"]
    assert sealed["error"] is None
    assert effect["effect"] == "asymmetry"
    assert effect["d_prime"] == pytest.approx(40.0, rel=0.1), "the command was about what had been expected"
    assert sorted(path.name for path in (tmp_path / "open" / "abc").iterdir()) == ["0.h5", "drive.npz"]
    found = load(tmp_path / "open" / "abc" / "0.h5")
    assert found.outcome == "completed"
    thrust, command = found.first_of("thrust"), found.first_of("command_voltage")
    volts = command.value[np.searchsorted(command.time, thrust.time - 0.4, side="right") - 1]
    top = sealed["scale"]["voltage"]
    rest = np.median(thrust.value[volts == 0.0])
    ahead, astern = (np.median(thrust.value[np.isclose(volts, v, atol=0.01)]) - rest for v in (top, -top))
    assert rest == pytest.approx(sealed["tare"][0], abs=3 * sealed["noise"]["white"])
    assert ahead == pytest.approx(sealed["baseline"]["C"] * top**2, rel=0.01)
    assert -astern / ahead == pytest.approx(effect["parameters"]["ratio"], rel=0.01)
    assert "asymmetry" not in json.dumps([found.attributes, [event.text for event in found.events]])


def test_an_instant_is_sealed_by_the_clock_of_the_recording(tmp_path):
    """The bench runs for a second or two before a recording begins."""
    asked = {"token": "abc", "seed": [5], "bench": "tunnel", "effects": ["zero_offset"], "strength": 500.0}
    conceal(asked | {"plan": "interleaved", "duration": 40.0}, tmp_path, record_in_virtual_time)
    (effect,) = json.loads((tmp_path / "sealed" / "abc.json").read_text(encoding="utf-8"))["effects"]
    found = load(tmp_path / "open" / "abc" / "0.h5")
    thrust, command = found.first_of("thrust"), found.first_of("command_voltage")
    F = thrust.value - np.median(thrust.value)
    volts = command.value[np.maximum(np.searchsorted(command.time, thrust.time, side="right") - 1, 0)]
    left = F - F @ (volts * np.abs(volts)) / np.sum(volts**4) * volts * np.abs(volts)
    jump = [np.var(left[:k]) * k + np.var(left[k:]) * (left.size - k) for k in range(20, left.size - 20)]
    at = thrust.time[20 + int(np.argmin(jump))]
    assert at == pytest.approx(effect["parameters"]["start"], abs=0.2)


def test_a_run_that_does_not_come_to_its_end_is_said_in_the_seal(tmp_path):
    def broken(*_):
        raise RuntimeError("the run ended tripped: too hot")

    conceal({"token": "abc", "seed": [5], "bench": "tunnel", "duration": 30.0}, tmp_path, broken)
    assert "too hot" in json.loads((tmp_path / "sealed" / "abc.json").read_text(encoding="utf-8"))["error"]
    assert not (tmp_path / "open" / "abc").exists()


@pytest.mark.parametrize(
    ("asked", "why"),
    [
        ({"token": "abc", "seed": [1]}, "expected token, seed, bench"),
        ({"token": "abc", "seed": [1], "bench": "tunnel", "noise": "white"}, "expected token, seed, bench"),
        ({"token": "abc", "seed": [1], "bench": "tunnel", "world": "other"}, "this is world"),
        ({"token": "abc", "seed": [1], "bench": "river"}, "case abc: bench must be one of"),
    ],
)
def test_a_table_that_cannot_be_read_is_refused(tmp_path, asked, why):
    with pytest.raises(WorldError, match=why):
        conceal(asked, tmp_path, record_in_virtual_time)
