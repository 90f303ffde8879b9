"""`rig check` of levels between two set-points of the motor controller."""

from pathlib import Path

from rig.campaign.loading import load_campaign
from rig.operate.check import check_loaded, outlook_of

BENCHES = Path(__file__).parents[3] / "benches"
CAMPAIGN = """
[campaign]
name = "short"
bench = "{bench}"
output = "out"
thrusters = ["T2"]
[tare]
duration = 1.0
[plan]
kind = "levels"
voltages = [5.0, -5.0, 7.2]
slew = 9.0
[plan.dwell]
kind = "fixed"
duration = 2.5
"""


def rows(folder: Path, bench: str) -> dict[str, str]:
    path = folder / "campaign.toml"
    path.write_text(CAMPAIGN.format(bench=BENCHES / bench / "bench.toml"), encoding="utf-8")
    return dict(outlook_of(check_loaded(load_campaign(path)), {}).rows())


def test_what_cannot_be_told_is_said(tmp_path):
    said = rows(tmp_path, "roboteq")["set-points"]
    assert said.startswith("5 V is 4.992 V: the nearest")


def test_nothing_is_said_where_the_steps_are_fine(tmp_path):
    assert "set-points" not in rows(tmp_path, "simulated")
