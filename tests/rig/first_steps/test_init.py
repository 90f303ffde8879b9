"""`rig init`: the files that come with the package are those of the repository, and a campaign that may run."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from rig.cli import main
from rig.first_steps.command import NAMES
from rig.operate.check import check_campaign
from sim_devices.bench.settings import load

BENCHES = Path(__file__).parents[3] / "benches" / "simulated"


def test_a_folder_with_bench_world_and_campaign(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "my bench"
    assert main(["init", str(folder)]) == 0
    assert sorted(path.name for path in folder.iterdir()) == sorted(NAMES)
    for name in ("bench.toml", "world.toml"):
        assert (folder / name).read_text() == (BENCHES / name).read_text()
    lines = capsys.readouterr().out.splitlines()
    commands = [line.split("    # ")[0].strip() for line in lines[lines.index("next:") + 1 :]]
    assert [re.sub(r"^\S*python", "python", command) for command in commands] == [
        f"python -m sim_devices '{folder}/world.toml' &",
        f"rig check '{folder}/campaign.toml'",
        f"rig run '{folder}/campaign.toml'",
    ]


def test_its_campaign_may_run_on_its_bench(tmp_path: Path) -> None:
    assert main(["init", str(tmp_path)]) == 0
    bench = tmp_path / "bench.toml"
    bench.write_text(re.sub(r'"ports/(\w+)"', rf'"{tmp_path}/\1"', bench.read_text()))
    for port in ("load_cell", "can0", "flow", "thermometer"):
        (tmp_path / port).touch()
    report = check_campaign(tmp_path / "campaign.toml")
    assert report.peak_thrust == pytest.approx(102.4)
    assert report.total.expected < 60.0
    assert report.campaign.output == tmp_path / "recordings"
    assert set(report.campaign.thrusters) <= set(load(tmp_path / "world.toml").world.thrusters)


@pytest.mark.parametrize("name", NAMES)
def test_nothing_is_overwritten(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path(name).write_text("mine")
    assert main(["init"]) == 2
    assert f"{name} exists; rig init overwrites nothing" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == [name]
    assert Path(name).read_text() == "mine"
