"""What takes protection away is refused by name, unless the same file says that it is meant and why."""

from pathlib import Path

import pytest

from rig.errors import ConfigError
from rig.operate.check import check_campaign, print_report
from rig.stages.preflight import armed_checks

WRONG = Path(__file__).parents[1] / "wrong"
LIMITS = '[limits."load_cell.thrust"]\nmin = -300.0\nmax = 300.0\n'


def campaign(folder: Path, change=("", ""), bench_tail: str = "", unproved: bool = False, tail: str = "") -> Path:
    """The right campaign with a piece of its bench file exchanged."""
    bench = (WRONG / "right_bench.toml").read_text()
    assert change[0] in bench
    (folder / "right_bench.toml").write_text(bench.replace(*change, 1) + bench_tail)
    text = (WRONG / "right.toml").read_text()
    text = text.replace("expected_C", "prove_watchdog = false\nexpected_C") if unproved else text
    (folder / "c.toml").write_text(text + tail)
    return folder / "c.toml"


DISARMING = {
    "bench.watchdog_limit": ("slew = 24.0", "slew = 24.0\nwatchdog_limit = 3600.0"),
    "bench.coast_time": ("slew = 24.0", "slew = 24.0\ncoast_time = 1e9"),
    "bench.rest_rate": ("slew = 24.0", "slew = 24.0\nrest_rate = 1000.0"),
    "limits.load_cell.thrust.max_age": (LIMITS, LIMITS + "max_age = 1e9\n"),
    "limits.load_cell.thrust.max_frozen": (LIMITS, LIMITS + "max_frozen = inf\n"),
    "limits.load_cell.thrust.min": (LIMITS, LIMITS.replace("min = -300.0\n", "")),
    "limits.load_cell.thrust.max": (LIMITS, LIMITS.replace("max = 300.0", "max = inf")),
    "limits.motor.current.max": ('[limits."motor.current"]\nmax = 40.0', ""),
}


@pytest.mark.parametrize("key", DISARMING)
def test_it_is_refused_by_name_and_passes_with_a_reason(key, tmp_path):
    with pytest.raises(ConfigError, match=f'right_bench.toml: {key}: .*"{key}" = "the reason"'):
        check_campaign(campaign(tmp_path, DISARMING[key]))
    meant = campaign(tmp_path, DISARMING[key], bench_tail=f'\n[overrides]\n"{key}" = "tried by hand"\n')
    (only,) = check_campaign(meant).overridden
    assert (only.key, only.reason) == (key, "tried by hand")
    assert [(c.name, c.verdict) for c in armed_checks([only])] == [("override", "warning")]
    assert armed_checks([only._replace(reason=None)])[0].verdict == "failed"


def test_a_watchdog_that_is_not_proved_needs_an_override_of_the_campaign(tmp_path, capsys):
    from rich.console import Console

    with pytest.raises(ConfigError, match=r"c\.toml: campaign\.prove_watchdog"):
        check_campaign(campaign(tmp_path, unproved=True))
    tail = '\n[overrides]\n"campaign.prove_watchdog" = "proved this morning"\n'
    print_report(check_campaign(campaign(tmp_path, unproved=True, tail=tail)), Console(width=200))
    assert "OVERRIDE       campaign.prove_watchdog: the motor's own watchdog" in capsys.readouterr().out


@pytest.mark.parametrize("reason", ['""', "true", "3"])
def test_a_reason_is_a_text(reason, tmp_path):
    tail = f'\n[overrides]\n"bench.rest_rate" = {reason}\n'
    with pytest.raises(ConfigError, match="must be a text that says why"):
        check_campaign(campaign(tmp_path, DISARMING["bench.rest_rate"], bench_tail=tail))


def test_an_override_of_nothing_is_refused(tmp_path):
    tail = '\n[overrides]\n"bench.rest_rate" = "no longer needed"\n'
    with pytest.raises(ConfigError, match="overrides nothing"):
        check_campaign(campaign(tmp_path, bench_tail=tail))


def test_a_right_campaign_takes_nothing_away():
    assert check_campaign(WRONG / "right.toml").overridden == ()
