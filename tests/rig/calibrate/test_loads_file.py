"""The plan of a calibration: what it says, and the sentence where it can't be used."""

import math

import pytest

from rig.calibrate.loads_file import load_plan
from rig.errors import ConfigError
from tests.rig.calibrate.weighing_bench import LOADS, ROOT


def plan(folder, text=LOADS):
    path = folder / "loads.toml"
    path.write_text(text)
    return load_plan(path)


def test_up_and_down_in_both_directions(tmp_path):
    found = plan(tmp_path)
    said = [load.said for load in found.loads]
    assert said[:6] == ["no load", "2kg", "5kg", "10kg", "10kg + 5kg + 2kg", "10kg"]
    assert said[8:11] == ["no load", "2kg backward", "5kg backward"]
    assert len(said) == 17
    assert found.shortest == pytest.approx(17 * 3.0)


def test_how_well_a_mass_is_known(tmp_path):
    found = plan(tmp_path).weights
    assert found["1kg"].std == pytest.approx(8e-6)
    assert found["2kg"].std == pytest.approx(30e-6 / math.sqrt(3.0))
    assert found["5kg"].std == 40e-6


def test_gravity_of_a_latitude(tmp_path):
    place = plan(tmp_path, LOADS.replace("gravity = 9.8055\ngravity_std = 3e-5", "latitude = 44.4")).place
    assert place.gravity == pytest.approx(9.8056, abs=3e-4)
    assert place.gravity_std == 3e-4


def test_the_plan_of_the_demo_can_be_used():
    found = load_plan(ROOT / "benches" / "simulated" / "loads.toml")
    assert len(found.loads) == 48
    assert found.unread == {0, 12, 24, 36}, "the largest load hangs before each ladder"


def test_preloads_hang_before_each_ladder(tmp_path):
    found = plan(tmp_path, LOADS.replace("preloads = 0", "preloads = 2"))
    said = [load.said for load in found.loads]
    most = "10kg + 5kg + 2kg"
    assert said[:5] == [most, "no load", most, "no load", "2kg"]
    assert said[11:16] == ["no load", f"{most} backward", "no load", f"{most} backward", "no load"]
    assert [said[at].removesuffix(" backward") for at in sorted(found.unread)] == 2 * [most, "no load", most]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('["2kg"]', '["3kg"]', "steps.ladder hangs '3kg', but .weights.pieces. has 1kg, 2kg"),
        ("gravity = 9.8055", "gravity = 9.8055\nlatitude = 3.0", "give gravity .* or latitude"),
        ("gravity = 9.8055\ngravity_std = 3e-5", "", "give gravity .* or latitude"),
        ("std = 40e-6", "std = 40e-6, expanded = 1e-3", "say how well the mass is known"),
        ("mass = 5.0", "mass = -5.0", "weight 5kg: mass must be above 0 kg"),
        ("directions = [1, -1]", "directions = [2]", "directions must be of 1 and -1"),
        ("hold = 2.0", "hold = -2.0", "settle, hold and steady must be above 0"),
        ("hold = 2.0", "holds = 2.0", "did you mean steps.hold"),
        ('"10kg", "5kg", "2kg"', '"10kg", "10kg"', "a weight hangs twice"),
        ("gravity = 9.8055", "gravity = 1.62", "gravity must be between"),
        ('certificate = "DKD 7"', "stability = 0.5", "stability is relative"),
        ('certificate = "DKD 7"', "valid_days = 0", "valid_days must be at least 1"),
        ("[steps]", '[hang]\ncommand = ["x {weight}"]\n[steps]', "braces that mean nothing"),
        ("[steps]", "[stops]", "unknown key stops; did you mean steps"),
    ],
)
def test_what_can_not_be_used(tmp_path, old, new, said):
    assert old in LOADS
    with pytest.raises(ConfigError, match=said):
        plan(tmp_path, LOADS.replace(old, new))
