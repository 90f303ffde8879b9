"""TOML of strangers: what is no file, too large, too deep or beyond its numbers is refused in a sentence."""

import os
import time

import pytest

from rig.cli import main
from rig.errors import ConfigError
from rig.toml_tables import MOST_BYTES, MOST_DEPTH, parsed, read_toml


@pytest.mark.parametrize(
    ("kind", "said"), [("fifo", "a pipe"), ("/dev/zero", "a device"), ("/dev/tty", "can't be read|a device")]
)
def test_what_is_no_file_is_refused_at_once(tmp_path, capsys, kind, said):
    path = tmp_path / "bench.toml"
    if kind == "fifo":
        os.mkfifo(path)
    else:
        path = kind
    with pytest.raises(ConfigError, match=said):
        read_toml(tmp_path / path, "bench file")
    campaign = tmp_path / "c.toml"
    campaign.write_text(f'[campaign]\nname = "c"\nbench = "{path}"\nthrusters = ["T1"]\noutput = "out"\n')
    assert main(["check", str(campaign)]) == 2
    err = capsys.readouterr().err
    assert "regular file" in err or "can't be read" in err


def test_a_folder_a_missing_file_and_one_that_is_too_long(tmp_path):
    with pytest.raises(ConfigError, match="is a folder, but a bench file must be a regular file"):
        read_toml(tmp_path, "bench file")
    with pytest.raises(ConfigError, match="no such bench file"):
        read_toml(tmp_path / "none.toml", "bench file")
    with pytest.raises(ConfigError, match="can't be read"):
        read_toml(tmp_path / "a\0b", "bench file")
    (tmp_path / "long.toml").write_text("#" * (MOST_BYTES + 1))
    with pytest.raises(ConfigError, match=f"has {MOST_BYTES + 1} bytes"):
        read_toml(tmp_path / "long.toml", "bench file")


@pytest.mark.parametrize(
    "text",
    [
        "x = " + "[" * 100_000,
        "x = " + "{a = " * 100_000,
        "x = " + "[" * 30 + "]" * 30,
        ".".join("a" * 400_000) + " = 1",
        " . ".join(['"a"'] * 200_000) + " = 1",
        "[" + ".".join("a" * 400_000) + "]",
        "x = " + "9" * 5000,
        "x = " + "9" * 310,
        "x = 0x" + "f" * 100_000,
        "x = [1, {y = [9223372036854775808]}]",
    ],
    ids=range(10),
)
def test_depth_and_digits_are_bounded(text):
    begun = time.process_time()
    with pytest.raises(ConfigError):
        parsed(text, "bench.toml")
    assert time.process_time() - begun < 2.0


def test_what_is_long_and_sound_is_read():
    numbers = ", ".join(["0.25"] * 100_000)
    sentence = ". ".join(["word"] * 1000)
    deep = ".".join("a" * (MOST_DEPTH - 1))
    content = parsed(
        f'volts = [{numbers}]\nnote = "{sentence}"\n{deep} = 9223372036854775807\nhash = "{"f" * 64}"', "x"
    )
    assert len(content["volts"]) == 100_000
    assert content["note"] == sentence
