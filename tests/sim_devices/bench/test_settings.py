"""World files: what is wrong is said with file, table and the nearest known name."""

import pytest

from sim_devices.bench.settings import load
from sim_devices.tables import WorldError

GOOD = """
[thrusters]
T1 = { C = 0.4 }
[devices.motor]
kind = "vesc"
"""


def test_paths_are_relative_to_the_file(tmp_path):
    (tmp_path / "w.toml").write_text('links = "p"\ntruth = "p/t.jsonl"\n' + GOOD)
    settings = load(tmp_path / "w.toml")
    assert (settings.links, settings.truth) == (tmp_path / "p", tmp_path / "p" / "t.jsonl")
    (tmp_path / "w.toml").write_text(GOOD)
    assert load(tmp_path / "w.toml").truth is None


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("seeed = 1\n" + GOOD, "did you mean 'seed'"),
        ("seed = -1\n" + GOOD, "whole number"),
        ("step = 0.1\n" + GOOD, "at most 0.005"),
        ("seed = \n", "is not TOML"),
        (GOOD.replace("vesc", "vescc"), "did you mean 'vesc'"),
        (GOOD.replace('kind = "vesc"', "vesc_id = 2"), "with kind = one of"),
        (GOOD + "time_out = 1.0\n", "did you mean 'timeout'"),
        (GOOD + 'uuid = "00"\n', "12 bytes"),
        (GOOD + '[devices.other]\nkind = "vesc"\n', "one motor controller"),
        (GOOD + '[[faults]]\ndevice = "motor"\nfault = "frozen"\n', "'at' is missing"),
    ],
)
def test_what_is_wrong_is_said(tmp_path, text, sentence):
    path = tmp_path / "w.toml"
    path.write_text(text)
    with pytest.raises(WorldError, match=sentence) as error:
        load(path)
    assert str(error.value).startswith(str(path))


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(WorldError, match="cannot be read"):
        load(tmp_path / "nowhere.toml")
