"""The cell `wiring` of the blind proof: its design, its scores and its goals."""

from dataclasses import replace

from rig.blind import score_file
from rig.blind.collecting import Known
from rig.blind.design import design
from rig.blind.scoring.metrics import besides, goals
from rig.blind.scoring.score import scored
from rig.blind.workers import concealable
from sim_devices.concealed.cases.wiring import KINDS, NOTHING
from tests.rig.blind_scores import CATALOGUE, WORLD, answer, finding, order, truth

WIRED = replace(WORLD, wiring=(NOTHING, *KINDS))


def seal(kind, runs=2, **told):
    fault = None if kind == NOTHING else {"kind": kind, "run": 1, **told}
    recordings = [f"run{i}" for i in range(runs)]
    return truth("dead_band", fault=fault) | {"asked": {"wiring": kind}, "recordings": recordings}


def lie(form, *channels, run="run1"):
    return finding("channel_fault", form=form) | {"channels": list(channels), "recording": run}


def of(kind, *findings, runs=2, **told):
    return scored(order(f"wiring/{kind}/0"), seal(kind, runs, **told), answer("explained", *findings))


def test_there_are_as_many_cases_without_a_fault_as_with_one_and_no_other_cell_changes():
    before, after = (design(world, CATALOGUE, 20) for world in (WORLD, WIRED))
    more = [job for job in after if job.id.startswith("wiring/")]
    assert [job for job in after if job not in more] == before
    faulty = [job for job in more if job.spec["wiring"] != NOTHING]
    assert len(faulty) == 80
    assert len(more) == 160
    assert concealable().wiring == WIRED.wiring


def test_a_fault_is_right_by_its_form_and_its_channels():
    told = {"channel": "command_voltage", "other": "current"}
    exchange = of("current_for_command", lie("swapped", "current", "command_voltage"), finding("dead_band"), **told)
    assert (exchange.right, exchange.wired.run, exchange.wired.thrust_blamed) == (True, True, False)
    assert not of("current_for_command", lie("swapped", "current", "bus_voltage"), **told).right
    assert not of("current_for_command", finding("dead_band"), **told).right
    driver = of("driver_changed", lie("driver", "command_voltage", run="run0"), channel="command_voltage")
    assert (driver.right, driver.wired.run) == (True, None), "of two runs nobody knows which"
    three = of("driver_changed", lie("driver", "command_voltage", run="run0"), runs=3, channel="command_voltage")
    assert (three.right, three.wired.run) == (True, False)
    twice = of("thrust_unit", lie("rescaled", "thrust"), lie("reversed", "current"), channel="thrust")
    assert not twice.right


def test_thrust_is_blamed_wrongly_where_another_channel_changed():
    assert of("rate_unit", lie("rescaled", "thrust"), channel="rotation_rate").wired.thrust_blamed
    assert of(NOTHING, finding("thrust_constant") | {"channels": []}).wired.thrust_blamed
    assert not of("thrust_unit", lie("rescaled", "thrust"), channel="thrust").wired.thrust_blamed


def test_where_nothing_changed_any_fault_is_an_alarm():
    assert of(NOTHING, finding("dead_band")).right
    assert not of(NOTHING, lie("driver", "command_voltage")).right


def test_the_goals_count_them():
    scores = [
        of("thrust_unit", lie("rescaled", "thrust"), channel="thrust"),
        of("rate_unit", lie("rescaled", "thrust"), channel="rotation_rate"),
        of(NOTHING),
        of(NOTHING, lie("driver", "command_voltage")),
    ]
    found = {g.what: (g.value, g.n) for g in (*goals(scores), *besides(scores)) if "wiring" in g.what}
    assert found == {
        "wiring between runs: the fault, by kind and channel": (0.5, 2),
        "wiring between runs: thrust blamed wrongly": (0.25, 4),
        "wiring between runs, nothing changed: false alarms": (0.5, 2),
        "wiring between runs: the run, where it can be known": (1.0, 1),
    }


def test_such_a_score_comes_back_from_a_file(tmp_path):
    known = Known(of("thrust_unit", lie("rescaled", "thrust"), channel="thrust"), "abc", "def")
    score_file.write(tmp_path / "scores.jsonl", [known])
    assert score_file.read(tmp_path / "scores.jsonl") == [known]
