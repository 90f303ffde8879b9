"""Names that would lead out of a folder, into an option or onto a terminal are refused where they come in."""

from pathlib import Path

import pytest

from rig.campaign.loading import load_bench, load_campaign
from rig.errors import ConfigError, RecordingError
from rig.recording.recorder_link import recording_path
from rig.stages import controller
from rig.toml_tables import read_toml

WRONG = Path(__file__).parents[1] / "wrong"
BAD = ("../../../x", "/etc/x", "a/b", "a\\b", "..", ".hidden", "-rf", "T1\n", "T1\x1b]0;pwned\x07", "\u202eT1", "", " ")
GOOD = ("T1", "T 1", "T1 (left), 2026", "Schraube 3 äöü", "a..b", "x" * 100)


def as_toml(text: str) -> str:
    return '"' + "".join(f"\\U{ord(letter):08X}" for letter in text) + '"'


def campaign(folder: Path, name: str = "n", thruster: str = "T") -> Path:
    """The right campaign of the neighbouring tests with another name or thruster."""
    path = folder / "campaign.toml"
    bench = WRONG / "right_bench.toml"
    plan = '[plan]\nkind = "levels"\nvoltages = [2.0]\nslew = 24.0\n[plan.dwell]\nkind = "fixed"\nduration = 1.0\n'
    names = f"name = {as_toml(name)}\nthrusters = [{as_toml(thruster)}]"
    path.write_text(f'[campaign]\n{names}\nbench = "{bench}"\noutput = "."\n{plan}')
    return path


@pytest.mark.parametrize("name", BAD)
def test_bad_names_are_refused_at_load(tmp_path, name):
    for key, argument in (("campaign.thrusters", "thruster"), ("campaign.name", "name")):
        made = campaign(tmp_path, **{argument: name})
        with pytest.raises(ConfigError) as error:
            load_campaign(made)
        assert str(error.value).startswith(f"{made}: {key} is {name!r}, which ")
        assert "expected a plain name" in str(error.value)
        assert "\x1b" not in str(error.value)


@pytest.mark.parametrize("name", GOOD)
def test_good_names_are_kept(tmp_path, name):
    found = load_campaign(campaign(tmp_path, name=name, thruster=name))
    assert (found.name, found.thrusters) == (name, (name,))
    assert recording_path(tmp_path, name).parent == tmp_path


@pytest.mark.parametrize("name", BAD)
def test_no_recording_outside_its_folder_whoever_asks(tmp_path, name):
    """Also a name that came by another way than a campaign file."""
    with pytest.raises(RecordingError, match="can't be called"):
        recording_path(tmp_path, name)


def test_names_of_bench_and_devices(tmp_path):
    right = (WRONG / "right_bench.toml").read_text()
    path = tmp_path / "bench.toml"
    name = read_toml(WRONG / "right_bench.toml", "bench file")[1]["bench"]["name"]
    for old, new, key in (
        (f'name = "{name}"', 'name = "../x"', "bench.name"),
        ("[devices.load_cell]", '[devices."../load_cell"]', "[devices]"),
    ):
        assert old in right
        path.write_text(right.replace(old, new))
        with pytest.raises(ConfigError, match="expected a plain name") as error:
            load_bench(path)
        assert key in str(error.value)


def test_a_thruster_that_only_a_ledger_names_is_not_run(tmp_path, capsys):
    assert controller.main(str(campaign(tmp_path)), str(tmp_path), "../../../x") == 2
    assert "asked to run the thruster '../../../x', which is not in the campaign" in capsys.readouterr().err
    assert {path.name for path in tmp_path.iterdir()} == {"campaign.toml"}
