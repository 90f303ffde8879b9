"""rig check: the report of a right campaign, one clear sentence for each wrong one, nothing opened."""

import io
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner
from rich.console import Console

from rig.cli import main
from rig.errors import RigError
from rig.operate.check import check_campaign, check_command, print_report

WRONG = Path(__file__).parents[1] / "wrong"
EXAMPLES = [p for p in sorted(WRONG.glob("*.toml")) if not p.stem.endswith("_bench") and p.stem != "right"]


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda p: p.stem)
def test_wrong_configuration_exits_2_with_one_sentence(path, capsys):
    expected = path.read_text().splitlines()[0].removeprefix("# expected: ")
    assert main(["check", str(path)]) == 2
    said = capsys.readouterr().err
    assert expected in said
    assert said.count("\n") == 1
    assert path.parent.name in said  # names the file


def test_there_are_more_than_ten_examples():
    assert len(EXAMPLES) >= 10


def test_report_of_a_right_campaign():
    report = check_campaign(WRONG / "right.toml")
    assert report.peak_voltage == 20.0
    assert report.peak_thrust == pytest.approx(160.0)
    assert report.run.expected < report.run.worst
    assert report.total.worst == pytest.approx(report.run.worst + 30.0)  # the mounting


def test_what_is_printed():
    result = CliRunner().invoke(check_command, [str(WRONG / "right.toml")], standalone_mode=False)
    assert result.exception is None
    for text in ("rest", "tare", "-10.00", "160 N expected", "20 V", "Nothing was opened"):
        assert text in result.output


def printed(report) -> str:
    out = io.StringIO()
    print_report(report, Console(file=out, width=200))
    return out.getvalue()


def test_a_peak_thrust_that_is_not_checked_is_said_so():
    assert "not checked" in printed(replace(check_campaign(WRONG / "right.toml"), peak_thrust=None))


def test_hours_are_shown_as_such():
    report = check_campaign(WRONG / "right.toml")
    assert "1:02:03 expected" in printed(replace(report, total=report.total._replace(expected=3723.0)))


def test_sines_need_no_samples_per_hold(tmp_path):
    path = tmp_path / "c.toml"
    path.write_text(
        f'[campaign]\nname = "n"\nbench = "{WRONG / "right_bench.toml"}"\noutput = "."\nthrusters = ["T"]\n'
        'prove_watchdog = false\n[plan]\nkind = "sine"\namplitude = 5\nfrequencies = [0.1]\ncycles = 2\nslew = 10\n'
        '[overrides]\n"campaign.prove_watchdog" = "only the plan is of interest"\n'
    )
    report = check_campaign(path)
    assert report.peak_thrust is None
    assert "± 5 at 0.1 Hz" in printed(report)


def test_tare_must_have_samples(tmp_path):
    path = tmp_path / "c.toml"
    text = (WRONG / "right.toml").read_text().replace("right_bench.toml", str(WRONG / "right_bench.toml"))
    path.write_text(text + "[tare]\nduration = 0.05\n")
    with pytest.raises(RigError, match=r"tare\.duration is 0\.05 s"):
        check_campaign(path)
