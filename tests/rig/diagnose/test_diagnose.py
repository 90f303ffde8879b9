"""rig diagnose, simulate and compare: what they say of good input and bad, and that a twin goes round."""

from __future__ import annotations

import importlib.util
import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner, Result

from rig.cli import rig
from rig.diagnose.text import diagnosis_text
from rig.errors import TwinError
from rig.hdf5 import load
from rig.twin.reading import read_twin
from rig.twin.simulate import Asked, simulated, timed
from rig.twin.writing import twin_json, write_twin
from tests.identification.diagnosed_runs import dead_band as dead_zone
from tests.identification.diagnosed_runs import run as small
from tests.rig.report_reading import open_fonts

ROOT = Path(__file__).parents[3]
RIGHT = Path(__file__).parents[1] / "wrong" / "right.toml"


def example(name: str):
    spec = importlib.util.spec_from_file_location(name, ROOT / "examples" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


bad = example("diagnose_bad_input")
plain = example("diagnose_plain_h5py")


def run(*arguments: object) -> Result:
    return CliRunner().invoke(rig, [str(a) for a in arguments])


def dead_band(columns: dict) -> None:
    """+-1.5 V put into the levels."""
    start, level, *_ = columns["command"]
    time, thrust, *named = columns["cell"]
    volts = level[np.searchsorted(start, time, side="right") - 1]
    acting = np.sign(volts) * np.maximum(np.abs(volts) - 1.5, 0.0)
    columns["cell"] = (time, thrust + 0.4 * (acting * np.abs(acting) - volts * np.abs(volts)), *named)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("diagnose")


@pytest.fixture(scope="module")
def dead(folder):
    """A recording with a dead band, its diagnosis as JSON, its twin."""
    path, out, twin = (
        bad.recording(folder / "dead.h5", change=dead_band),
        folder / "dead.json",
        folder / "dead.twin.json",
    )
    result = run("diagnose", path, "--json", out, "--save-twin", twin)
    assert result.exit_code == 0, result.output
    return path, json.loads(out.read_text()), twin, result.output


def test_a_dead_band_is_named_with_its_width_and_the_contract_is_kept(dead):
    _, said, _, text = dead
    assert said["format"] == "thruster-rig-diagnosis"
    assert said["version"] == 1
    effects = {f["effect"]: f for f in said["findings"]}
    assert "dead_band" in effects or "dead_band" in {r for f in said["findings"] for r in f["rivals"]}
    if "dead_band" in effects:
        width = effects["dead_band"]["parameters"]["half_width"]
        assert abs(width["value"] - 1.5) < 5 * width["std"] + 0.02
    assert said["fit"]["heldout"]["rmse_after"] < 0.7 * said["fit"]["heldout"]["rmse_before"]
    assert {"channel", "where", "share", "p_value", "statement"} <= set(said["mismatch"][0])
    assert max(map(len, text.splitlines())) <= 100


@pytest.fixture(scope="module")
def short(folder):
    """A minute of levels with a dead band of 1.5 V."""
    channels = small(volts=dead_zone(1.5), seconds=60.0, rate=10.0).channels
    plain.write(folder / "short.h5", *(array for c in channels for array in (c.time, c.value)))
    return folder / "short.h5"


def test_explained_the_answer_is_followed_by_every_stage(short):
    result = run("diagnose", short, "--explain")
    assert result.exit_code == 0, result.output
    answer, told = result.output.split("How it came to that")
    assert answer.startswith("somebody's: explained.")
    for stage in ("prepare", "faults", "select", "periodic", "locate", "name", "validate", "unnamed", "answer"):
        assert f". {stage}: " in told
    assert max(map(len, result.output.splitlines())) <= 100


def test_explained_beside_json_standard_output_is_the_json_alone(short):
    result = run("diagnose", short, "--explain", "--json", "-")
    assert json.loads(result.stdout)["verdict"] == "explained"
    assert "1. prepare: " in result.stderr


def test_against_its_own_twin_the_same_recording_is_adequate(dead):
    path, _, twin, _ = dead
    result = run("diagnose", path, "--twin", twin, "--json", "-")
    said = json.loads(result.output)
    assert said["verdict"] == "adequate", said["statement"]
    assert "the twin dead.twin.json" in said["baseline"]["model"]
    assert any("half_width" in name or "." in name for name in said["baseline"]["parameters"])


def test_a_thruster_that_lost_thrust_is_told_from_its_twin(folder, dead):
    _, _, twin, _ = dead

    def weaker(columns: dict) -> None:
        dead_band(columns)
        time, thrust, *rest = columns["cell"]
        columns["cell"] = (time, 0.95 * thrust, *rest)

    said = json.loads(
        run("diagnose", bad.recording(folder / "weak.h5", seed=4, change=weaker), "--twin", twin, "--json", "-").output
    )
    changed = {f["effect"]: f for f in said["findings"]}["thrust_constant"]
    assert abs(changed["parameters"]["C"]["value"] / changed["parameters"]["before"]["value"] - 0.95) < 0.01


def test_a_twin_file_reads_back_as_it_was_written(dead, tmp_path):
    _, _, path, _ = dead
    twin = read_twin(path)
    write_twin(twin, tmp_path / "again.json")
    assert json.loads(json.dumps(twin_json(read_twin(tmp_path / "again.json")))) == json.loads(path.read_text())
    assert len(twin.sources[0].sha256) == 64
    assert np.array(twin.covariance).shape == (len(twin.names),) * 2


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t: t.update(format="other"), "its format is 'other'"),
        (lambda t: t.update(version=3), "is later than 2"),
        (lambda t: t.pop("C"), "C is missing"),
        (lambda t: t.update(C="much"), "C must be a finite number, got 'much'"),
        (lambda t: t.update(driver="wind"), "driver must be one of command_voltage"),
        (lambda t: t["terms"][0].update(effect="gremlin"), "must be an effect of the catalogue"),
        (lambda t: t["terms"][0].update(form="odd"), "must be a form of"),
        (lambda t: t["terms"][0]["parameters"].clear(), "is missing"),
        (lambda t: t["terms"][0]["parameters"].update(colour={"value": 1}), "has colour; the parameters of"),
        (lambda t: next(iter(t["terms"][0]["parameters"].values())).update(value=1e9), "must be within"),
        (lambda t: next(iter(t["terms"][0]["parameters"].values())).update(unit="furlong"), "unit must be"),
        (lambda t: t["covariance"]["matrix"].pop(), "rows of"),
        (lambda t: t["covariance"]["names"].reverse(), "in the order of C and the terms"),
        (lambda t: t["covariance"]["matrix"][0].__setitem__(1, 1.0), "symmetric"),
        (lambda t: t["noise"].update(scales=[1.0]), "as long as scales"),
        (lambda t: t.update(recordings="none"), "a list of objects"),
    ],
)
def test_a_broken_twin_is_one_sentence(dead, tmp_path, change, words):
    content = json.loads(dead[2].read_text())
    if content["noise"]["scales"] and "scales" in words:
        content["noise"]["slow"] = [1.0, 1.0]
    change(content)
    path = tmp_path / "broken.json"
    path.write_text(json.dumps(content))
    with pytest.raises(TwinError) as error:
        read_twin(path)
    assert words in str(error.value)
    assert "\n" not in str(error.value)


def test_a_replayed_command_is_predicted_and_adequate_against_the_twin(dead, folder):
    path, _, twin, _ = dead
    out = folder / "replayed.h5"
    result = run("simulate", path, "--twin", twin, "-o", out, "--noise", 7)
    assert result.exit_code == 0, result.output
    simulated, real = load(out), load(path)
    assert simulated.kind == "tunnel"
    assert "Simulated, not measured" in str(simulated.attributes["notes"])
    difference = real.first_of("thrust").value - np.interp(
        real.first_of("thrust").time, simulated.first_of("thrust").time, simulated.first_of("thrust").value
    )
    assert np.median(np.abs(difference)) < 0.5
    again = run("simulate", path, "--twin", twin, "-o", out)
    assert again.exit_code == 2
    assert "never overwritten" in again.output
    assert json.loads(run("diagnose", out, "--twin", twin, "--json", "-").output)["verdict"] == "adequate"


@pytest.mark.parametrize(
    ("words", "says"),
    [
        *((f"{command} --seed -1", "-1 is not in the range x>=0") for command in ("diagnose", "compare", "settle")),
        ("simulate --noise -1", "-1 is not in the range x>=0"),
        ("simulate --rate inf", "--rate must be a finite number"),
        ("simulate --rate nan", "--rate must be a finite number"),
        ("simulate --flow-speed nan", "--flow-speed must be a finite number"),
    ],
)
def test_a_number_that_cannot_be_used_is_refused(words, says, tmp_path):
    """Each was a traceback; a flow that is no number made thrust that is none."""
    command, *option = words.split()
    files = {"compare": ["a.h5", "b.h5"], "simulate": ["a.h5", "--twin", "t.json", "-o", "c.h5"]}.get(command, ["a.h5"])
    result = run(command, *files, *option)
    assert result.exit_code == 2
    assert says in result.output


def test_more_samples_than_a_recording_can_hold_are_refused():
    wanted = Asked(None, (), 0.0, 3600.0, "an hour")
    with pytest.raises(TwinError, match="an hour: more than 10,000,000 samples at 1e\\+12 samples/s"):
        simulated(SimpleNamespace(interval=0.05), wanted, 1e12, None)


def test_a_campaign_is_predicted_with_its_steps(dead, folder):
    out = folder / "campaign.h5"
    result = run("simulate", ROOT / "campaigns" / "staircase.toml", "--twin", dead[2], "-o", out)
    assert result.exit_code == 0, result.output
    found = load(out)
    holds = [s for s in found.steps if s.phase == "hold"]
    assert holds
    twin, thrust = read_twin(dead[2]), found.first_of("thrust")
    top = max(holds, key=lambda s: s.command_voltage)
    _, values = thrust.window(top.t_end - 1.0, top.t_end)
    assert values.mean() == pytest.approx(twin.C * top.command_voltage**2, rel=0.25)


def test_ramps_and_sines_of_a_plan_become_rows():
    from rig.campaign.plan import Step

    plan = [Step(0, "ramp", 2.0, 1.0, 1.0), Step(1, "sine", 0.0, 2.0, 2.0, amplitude=3.0, frequency=0.5)]
    rows, steps, end = timed(plan, 0.1)
    assert end == pytest.approx(3.0)
    assert [s.t_start for s in steps] == [0.0, 1.0]
    assert max(v for _, v in rows) == pytest.approx(3.0)


def noiseless(columns: dict) -> None:
    start, level, *_ = columns["command"]
    time, _, *rest = columns["cell"]
    volts = level[np.searchsorted(start, time, side="right") - 1]
    columns["cell"] = (time, 0.4 * volts * np.abs(volts), *rest)


@pytest.fixture(scope="module")
def simulation(folder):
    open_fonts()
    return bad.recording(folder / "foreign.h5", "model 7", change=noiseless)


def test_compare_names_what_the_simulation_leaves_out(simulation, dead):
    result = run("compare", simulation, dead[0], "--json", "-")
    assert result.exit_code == 0, result.output
    said = json.loads(result.output)
    named = {f["effect"] for f in said["findings"]} | {r for f in said["findings"] for r in f["rivals"]}
    assert "dead_band" in named
    assert "the simulation foreign.h5" in said["baseline"]["model"]


def test_compare_writes_and_holds_out_as_diagnose_does(simulation, dead, folder, tmp_path):
    kept = bad.recording(folder / "kept.h5", seed=3, change=dead_band)
    out = {name: tmp_path / name for name in ("found.json", "found.html", "T1.twin.json", "next.toml")}
    options = ("--json", out["found.json"], "--report", out["found.html"], "--save-twin", out["T1.twin.json"])
    bench = ("--plan", out["next.toml"], "--campaign", RIGHT, "--budget", 60)
    result = run("compare", simulation, dead[0], "--holdout", kept, *options, *bench)
    assert result.exit_code == 0, result.output
    said = json.loads(out["found.json"].read_text())
    assert load(kept).recording_id in said["fit"]["heldout"]["what"]
    assert said["fit"]["heldout"]["rmse_after"] < 0.7 * said["fit"]["heldout"]["rmse_before"]
    assert out["next.toml"].exists() == (said["next_experiment"] is not None)
    assert ("no next experiment is needed" in result.stderr) == (said["next_experiment"] is None)
    assert "the simulation foreign.h5" in out["found.html"].read_text()
    twin = read_twin(out["T1.twin.json"])
    assert {s.recording_id for s in twin.sources} == {load(path).recording_id for path in (simulation, dead[0])}
    assert all(len(s.sha256) == 64 for s in twin.sources)
    again = run("diagnose", dead[0], "--twin", out["T1.twin.json"], "--json", "-")
    assert json.loads(again.output)["verdict"] == "adequate"


def test_compare_draws_each_effect_by_itself(simulation, dead):
    from identification.mismatch.compare.reported_runs import runs_of
    from rig.diagnose.compare import compare_files

    found = compare_files(simulation, dead[0])
    (one,) = runs_of(found.real, [found.recording])
    assert {(f.effect, f.form) for f in found.real.findings} <= set(one.effects)


def test_compare_holds_out_neither_of_the_two(simulation, dead):
    for one in (simulation, dead[0]):
        result = run("compare", simulation, dead[0], "--holdout", one)
        assert result.exit_code == 2
        assert "is both to be diagnosed and held out" in result.output


def test_compare_refuses_another_command(folder, dead):
    def slower(columns: dict) -> None:
        start, level, *rest = columns["command"]
        columns["command"] = (start, level[::-1].copy(), *rest)

    result = run("compare", bad.recording(folder / "slower.h5", change=slower), dead[0])
    assert result.exit_code == 2
    assert "was not driven as dead.h5 was: at" in result.output


def refused(folder: Path, *arguments: object) -> str:
    result = run("diagnose", *arguments)
    assert result.exit_code == 2, result.output
    lines = result.output.strip().splitlines()
    assert len(lines) == 1
    return lines[0]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (bad.without_thrust, "has no thrust channel"),
        (bad.without_command, "nothing tells what drove the thruster"),
        (bad.constant, "at least two levels are needed"),
        (bad.twenty, "has 20 thrust samples, at least 50 are needed"),
        (bad.all_nan, "has 0 finite thrust samples"),
        (bad.other_clock, "are both on one clock?"),
    ],
)
def test_a_recording_that_cannot_be_used_is_one_sentence(tmp_path, change, words):
    assert words in refused(tmp_path, bad.recording(tmp_path / "it.h5", change=change))


def test_files_that_are_not_what_is_asked_for(tmp_path, dead):
    (tmp_path / "notes.h5").write_text("good weather")
    assert "is not an HDF5 file" in refused(tmp_path, tmp_path / "notes.h5")
    assert "is not there" in refused(tmp_path, tmp_path / "nowhere.h5")
    empty = tmp_path / "empty"
    empty.mkdir()
    assert "a folder without recordings" in refused(tmp_path, empty)
    other = bad.recording(tmp_path / "T2.h5", "T2", 2)
    assert "several thrusters (T1, T2)" in refused(tmp_path, dead[0], other)
    assert "given twice" in refused(tmp_path, dead[0], dead[0])
    assert "hold out a recording of T1" in refused(tmp_path, dead[0], "--holdout", other)
    assert "the twin is of thruster T1" in refused(tmp_path, other, "--twin", dead[2])


def test_nan_blocks_are_gaps(tmp_path):
    result = run("diagnose", bad.recording(tmp_path / "gaps.h5", change=bad.nan_blocks), "--json", "-")
    assert json.loads(result.output)["verdict"] == "adequate"


def test_a_file_by_plain_h5py_is_diagnosed(tmp_path):
    found = plain.diagnosed(tmp_path, 25.0, 1.5, 0.0)
    (finding,) = found.findings
    assert finding.effect == "dead_band"
    assert abs(finding.parameters["half_width"].value - 1.5) < 0.05
    shaped = replace(found, notes=("A note.",))
    assert "- A note." in diagnosis_text(shaped)
    worse = replace(shaped, heldout=replace(shaped.heldout, before=1.0, after=1.1))
    assert "GROWS" in diagnosis_text(worse)
    assert "GROWS" not in diagnosis_text(replace(worse, heldout=replace(worse.heldout, after=1.0)))


def test_the_simulated_bench_runs_on_a_twin(dead, tmp_path):
    from sim_devices.bench.settings import load as load_world
    from sim_devices.world.headless import run as headless
    from sim_devices.world.noise import Noise

    twin = read_twin(dead[2])
    (tmp_path / "T1.twin.json").write_text(dead[2].read_text())
    world = tmp_path / "world.toml"
    world.write_text('twin = "T1.twin.json"\n[noise.thrust]\nwhite = 0.0\n')
    settings = load_world(world).world
    assert settings.mounted == "T1"
    assert settings.noise["thrust"] == Noise()
    out = headless(settings, [0.0, 1.0], [10.0, -6.0], 2.0, rates={"thrust": 50.0}, rng=np.random.default_rng(1))
    width = twin.terms[0].parameters["half_width"]
    assert out["thrust"].exact[25] == pytest.approx(twin.C * (10.0 - width) ** 2, rel=1e-6)
    assert out["thrust"].exact[-1] == pytest.approx(-twin.C * (6.0 - width) ** 2, rel=1e-6)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t: t["terms"][0].update(effect="rotation_coupling"), "cannot act the term 'rotation_coupling'"),
        (lambda t: t["terms"].append(t["terms"][0]), "is there twice"),
        (lambda t: t.update(driver="rotation_rate"), "commanded in volts"),
        (lambda t: t.pop("C"), "not as --save-twin writes it"),
        (lambda t: t.update(version=9), "is not a thruster-rig-twin of version 1 or 2"),
    ],
)
def test_a_twin_that_the_world_cannot_act_is_said(dead, tmp_path, change, words):
    from sim_devices.tables import WorldError
    from sim_devices.world.twin import with_twin

    content = json.loads(dead[2].read_text())
    change(content)
    (tmp_path / "it.json").write_text(json.dumps(content))
    with pytest.raises(WorldError, match=words):
        with_twin({"twin": "it.json"}, tmp_path)


def test_every_term_of_the_catalogue_that_the_world_knows_builds_its_effect():
    from identification.twin import TERMS
    from sim_devices.tables import WorldError
    from sim_devices.world import twin as world_twin
    from sim_devices.world.settings import make_effects

    left = []
    for (effect, form), term in TERMS.items():
        scale = read_scale()
        parameters = {
            p.name: {"value": v, "unit": p.unit}
            for p, v in zip(term.parameters(scale), term.trials(scale)[0], strict=True)
        }
        content = {
            "driver": "command_voltage",
            "rate_per_driver": 2.0,
            "C": 0.4,
            "terms": [{"effect": effect, "form": form, "parameters": parameters, "scale": {"driver": 20.0}}],
        }
        try:
            make_effects(world_twin.world_of(content)[1])
        except WorldError:
            left.append((effect, form))
    assert set(left) <= {
        ("heating", "measured_winding"),
        ("heating", "measured_magnet"),
        ("supply_sag", ""),
        ("supply_sag", "buffered"),
        ("supply_sag", "discharge"),
        ("supply_sag", "loaded"),
        ("motor_lag", "mixed"),
        ("inflow_dynamics", "momentum"),
        ("rotation_coupling", ""),
        ("thruster_interaction", ""),
        ("torque_crosstalk", "measured"),
        ("reversal_loss", "step"),
    }


def with_line(folder, dead, **line):
    """The twin of the dead band with a periodic disturbance in its file."""
    told = {
        "kind": "fixed",
        "turns": "rev",
        "amplitude": {"value": 0.3, "std": 0.01, "unit": "N"},
        "frequency": {"value": 7.3, "std": 0.001, "unit": "Hz"},
        "ratio": None,
        "phase": {"value": 1.0, "std": 0.1, "unit": "rad"},
    }
    content = json.loads(dead[2].read_text()) | {"version": 2, "lines": [told | line]}
    path = folder / "line.twin.json"
    path.write_text(json.dumps(content))
    return path


def test_a_prediction_has_the_line_and_says_what_is_known_of_its_phase(dead, tmp_path):
    path = with_line(tmp_path, dead)
    assert read_twin(path).lines[0].frequency == 7.3
    bare = run("simulate", dead[0], "--twin", dead[2], "-o", tmp_path / "bare.h5")
    told = run("simulate", dead[0], "--twin", path, "-o", tmp_path / "line.h5")
    assert bare.exit_code == told.exit_code == 0, told.output
    assert "A line of 0.3 N at 7.3 Hz is in it (phase of the first recording's clock)." in " ".join(told.output.split())
    with_, without = (load(tmp_path / name).first_of("thrust") for name in ("line.h5", "bare.h5"))
    wave = 0.3 * np.sin(2 * np.pi * 7.3 * with_.time + 1.0)
    assert with_.value - without.value == pytest.approx(wave, abs=1e-3)
    unknown = run("simulate", dead[0], "--twin", with_line(tmp_path, dead, phase=None), "-o", tmp_path / "slipped.h5")
    assert "its phase is not known: 0 here" in " ".join(unknown.output.split())


def test_a_line_that_is_no_line_is_one_sentence(dead, tmp_path):
    for line, words in (
        ({"kind": "both"}, "lines[0].kind must be fixed or rotation"),
        ({"kind": "rotation"}, "lines[0].ratio must be an object"),
        ({"turns": "laps"}, "lines[0].turns must be rev or V s"),
    ):
        with pytest.raises(TwinError) as error:
            read_twin(with_line(tmp_path, dead, **line))
        assert words in str(error.value)


RATIO = {"value": 3.001, "std": 0.001, "unit": "1/(rev)"}


def test_the_simulated_bench_has_the_line_or_says_that_it_cannot(dead, tmp_path):
    from sim_devices.tables import WorldError
    from sim_devices.world.twin import with_twin

    def effects(**line):
        path = with_line(tmp_path, dead, **line)
        return with_twin({"twin": path.name}, tmp_path)["effects"]["periodic_disturbance"]

    assert effects() == {"amplitude": 0.3, "frequency": 7.3, "phase": 1.0}
    assert effects(kind="rotation", ratio=RATIO, phase=None) == {"amplitude": 0.3, "blades": 3}
    with pytest.raises(WorldError, match=r"2\.4 periods per turn; the world has whole numbers only"):
        effects(kind="rotation", ratio=RATIO | {"value": 2.4})
    path = with_line(tmp_path, dead)
    content = json.loads(path.read_text())
    path.write_text(json.dumps(content | {"lines": 2 * content["lines"]}))
    with pytest.raises(WorldError, match="2 periodic disturbances; the world has one at a time"):
        with_twin({"twin": path.name}, tmp_path)


def read_scale():
    from identification.physics.term import Scale

    return Scale(20.0, "V", 160.0, 300.0, 0.01, 1.0, 170.0, 0.2, 7.0)
