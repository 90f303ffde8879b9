"""rig settle: what is refused before the bench is touched, and what it takes from bench and campaign."""

import sys
from pathlib import Path

import click
import numpy as np
import pytest

from rig.campaign.loading import load_campaign
from rig.cli import main
from rig.diagnose.outputs import Wanted
from rig.errors import ConfigError, RigError
from rig.hdf5 import RecordingFile
from rig.link.recorder_messages import ChannelSpec, Rows, StreamSpec
from rig.operate.flow_setting import by_command
from rig.operate.sequential_experiment import SequentialExperiment, bench_alone, fixed_cost
from rig.operate.settle import _leave

RIGHT = Path(__file__).parents[1] / "wrong" / "right.toml"
BENCH = Path(__file__).parents[3] / "benches" / "simulated" / "bench.toml"


@pytest.fixture
def recording(tmp_path):
    """One that two shapes describe: two levels of a thruster `thruster`, driven by `quantity`."""

    def write(thruster="T1", quantity="command_voltage", unit="V"):
        path = tmp_path / f"{thruster}-{quantity}.h5"
        start, level = np.array([0.0, 3.0, 7.0, 11.0]), np.array([0.0, 10.0, 20.0, 0.0])
        t = np.arange(0.0, 14.0, 0.05)
        V = level[np.searchsorted(start, t, side="right") - 1]
        F = 0.4 * np.maximum(V - 0.8, 0.0) ** 2 + 0.3 * np.random.default_rng(1).standard_normal(t.size)
        specs = [("command", quantity, unit), ("load_cell", "thrust", "N")]
        streams = [StreamSpec(name, "test", (ChannelSpec(q, q, u),)) for name, q, u in specs]
        attributes = {"recording_id": "first", "thruster": thruster, "kind": "tunnel", "software": "test"}
        file = RecordingFile(path, attributes, streams, t0_ns=0)
        rows = [(start, level), (t, F)] if unit == "V" else [(t, V), (t, F)]
        for k, (time, value) in enumerate(rows):
            file.add_rows(Rows(k, np.rint(time * 1e9).astype(np.int64), value[:, None]))
        file.close("completed", "", 14.0)
        return path

    return write


def refused(capsys, *words):
    assert main(["settle", *map(str, words)]) == 2
    return capsys.readouterr().err


def test_refusals_of_the_command_line(recording, tmp_path, capsys):
    first = recording()
    assert "give either --campaign" in refused(capsys, first)
    assert "give either --campaign" in refused(capsys, first, "--campaign", RIGHT, "--bench", BENCH)
    assert "--bench needs --output" in refused(capsys, first, "--bench", BENCH)
    assert "--budget must be a time" in refused(capsys, first, "--campaign", RIGHT, "--budget", "soon")
    assert "none.h5" in refused(capsys, tmp_path / "none.h5", "--campaign", RIGHT, "--output", tmp_path)
    assert "--flow pump '{speed}: No closing quotation" in refused(capsys, first, "--flow", "pump '{speed}")
    assert "--flow is empty" in refused(capsys, first, "--flow", "")


def test_an_answer_that_cannot_be_written_is_refused_before_anything_turns(recording, tmp_path, capsys):
    words = (recording(), "--campaign", RIGHT, "--output", tmp_path / "out")
    assert "there is no folder" in refused(capsys, *words, "--json", tmp_path / "absent" / "a.json")
    assert "names the same file" in refused(capsys, *words, "--json", tmp_path / "a", "--report", tmp_path / "a")
    assert not (tmp_path / "out").exists()


def test_an_answer_that_could_not_be_written_is_one_sentence(doubtful, tmp_path):
    experiment, _, _ = doubtful
    Rounds(experiment, 0.0, fails=RigError("the guard tripped"))
    with pytest.raises(RigError, match=r"the answer can't be written: .*absent"):
        _leave(experiment, *experiment.run(), Wanted(json_path=tmp_path / "absent" / "a.json"))


def test_a_thruster_that_the_campaign_does_not_have_is_refused(recording, tmp_path, capsys):
    said = refused(capsys, recording("T9"), "--campaign", RIGHT, "--output", tmp_path)
    assert "the recordings are of thruster T9" in said


def test_levels_in_revolutions_cannot_be_run(recording, tmp_path, capsys):
    first = recording(quantity="rotation_rate", unit="rev/s")
    assert "holds no voltage" in refused(capsys, first, "--campaign", RIGHT, "--output", tmp_path)


def test_an_experiment_that_does_not_fit_leaves_its_plan_and_moves_nothing(recording, tmp_path, capsys):
    folder = tmp_path / "out"
    experiment = SequentialExperiment(load_campaign(RIGHT), folder, [recording()], budget=20.0)
    folder.mkdir()
    said = []
    experiment.say = said.append
    _, course, end = experiment.run()
    assert (end.reason, course.rounds) == ("budget", ())
    assert said[0].startswith("first: ambiguous")
    plan = load_campaign(folder / "round-1.toml")
    assert not plan.unattended
    assert plan.bench.path.resolve() == load_campaign(RIGHT).bench.path.resolve()


class Rounds:
    """`SequentialExperiment` with made-up rounds: what each wants of the flow, and what becomes of it."""

    def __init__(self, experiment, *flows, fails=None):
        self.flows, self.fails, self.ran = list(flows), fails, []
        experiment._run = self.run
        self.experiment = experiment

    def run(self, plans):
        self.experiment._flow_at(self.flows[len(self.ran)])
        self.ran.append(self.experiment.flow)
        if self.fails and len(self.ran) == len(self.flows):
            raise self.fails
        return []


@pytest.fixture
def doubtful(recording, tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    experiment = SequentialExperiment(load_campaign(RIGHT), folder, [recording()], budget=3600.0)
    experiment.say = lambda text: said.append(text)
    said, speeds = [], []
    experiment.set_flow = speeds.append
    return experiment, speeds, said


def test_the_water_is_still_for_a_sweep_that_says_nothing_of_it_and_at_the_end(doubtful):
    experiment, speeds, _ = doubtful
    rounds = Rounds(experiment, 0.5, 0.0)  # the same doubt after two rounds is an end
    _, course, end = experiment.run()
    assert (end.reason, len(course.rounds)) == ("same_doubt", 2)
    assert rounds.ran == [0.5, 0.0]
    assert speeds == [0.5, 0.0]


@pytest.mark.parametrize(
    ("trouble", "told"),
    [
        (RigError("the guard tripped"), "the guard tripped"),
        (OSError("no room"), "no room"),
        (click.Abort(), "broken off by the operator"),
        (KeyboardInterrupt(), "broken off by the operator"),
    ],
)
def test_the_water_is_brought_to_rest_whatever_ends_it(doubtful, trouble, told):
    experiment, speeds, _ = doubtful
    Rounds(experiment, 0.8, fails=trouble)
    found, course, end = experiment.run()
    assert (end.reason, found.verdict, course.rounds) == ("aborted", "ambiguous", ())
    assert told in end.says
    assert speeds == [0.8, 0.0]


@pytest.mark.parametrize(
    ("trouble", "told"),
    [(RigError("the pump does not answer"), "does not answer"), (KeyboardInterrupt(), "broken off")],
)
def test_a_flow_that_does_not_stop_is_said(doubtful, trouble, told):
    experiment, speeds, said = doubtful

    def set_flow(speed):
        speeds.append(speed)
        if speed == 0.0:
            raise trouble

    experiment.set_flow = set_flow
    Rounds(experiment, 0.8, fails=RigError("the guard tripped"))
    assert experiment.run()[2].reason == "aborted"
    assert speeds == [0.8, 0.0]
    assert said[-1].startswith("THE WATER MAY STILL FLOW")
    assert told in said[-1]


def test_a_bench_alone_is_a_campaign_with_the_defaults(tmp_path):
    found = bench_alone(BENCH, "T1", tmp_path)
    assert (found.thrusters, found.plan.slew, found.unattended) == (("T1",), found.bench.slew, False)
    assert fixed_cost(found) > 2 * found.tare.duration
    with pytest.raises(ConfigError):
        bench_alone(tmp_path / "none.toml", "T1", tmp_path)


def test_the_flow_is_set_by_a_command(tmp_path):
    out = tmp_path / "flow"
    by_command(f"{sys.executable} -c \"open('{out}', 'w').write('{{speed}}')\"")(0.5)
    assert out.read_text() == "0.5"
    with pytest.raises(RigError, match="ended with status 3"):
        by_command(f"{sys.executable} -c 'raise SystemExit(3)'")(0.5)
    with pytest.raises(RigError, match=r"ended with status 1: Fl.gel"):
        by_command("sh -c 'printf \"Fl\\374gel\" >&2; exit 1'")(0.5)
    with pytest.raises(RigError, match="could not set 1 m/s"):
        by_command(str(tmp_path / "no-such-program"))(1.0)
