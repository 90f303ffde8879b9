"""`rig list` and `rig show` as a person and a program use them."""

import json
import re
from pathlib import Path

import pytest

from rig.cli import main
from tests.rig.catalogue.small_files import diagnosis, fit, ledger, recording, twin

PAGE = Path(__file__).parents[3] / "docs" / "howto" / "catalogue.md"


@pytest.fixture
def data(tmp_path, monkeypatch):
    """Two campaigns, a recording of a vehicle, and results."""
    spring, autumn = tmp_path / "spring-1", tmp_path / "autumn-1"
    ledger(spring, [("T1", "aaaa-1", "completed"), ("T2", "aabb-2", "tripped")], end="tripped")
    ledger(autumn, [("T1", "cccc-3", "completed")], name="autumn")
    recording(spring / "T1.h5", "aaaa-1", "T1", "2026-03-01T10:00:00Z", campaign="spring", operator="Ada")
    recording(spring / "T2.h5", "aabb-2", "T2", "2026-03-01T11:00:00Z", campaign="spring", outcome="tripped")
    recording(autumn / "T1.h5", "cccc-3", "T1", "2026-09-30T23:00:00Z", campaign="autumn")
    recording(tmp_path / "boat.h5", "dddd-4", "boat", "2026-10-02T12:00:00Z", kind="vehicle")
    fit(spring / "fits.json", "T1", ["aaaa-1"])
    diagnosis(spring / "d.json", "T2", ["aabb-2"], "ambiguous")
    twin(tmp_path / "twin.json", "T1", ["aaaa-1"])
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / ".cache"))
    return tmp_path


@pytest.fixture
def run(data, capfd):
    def run(*arguments, status=0):
        capfd.readouterr()
        assert main([str(each) for each in arguments]) == status
        return capfd.readouterr()

    return run


@pytest.fixture
def ids(run):
    return lambda *options: [e["id"] for e in json.loads(run("list", *options, "--json", "-").out)["entries"]]


def test_filters(ids, run):
    assert ids() == ["aaaa-1", "aabb-2", "cccc-3", "dddd-4"]
    assert ids("--thruster", "T1") == ["aaaa-1", "cccc-3"]
    assert ids("--kind", "vehicle") == ["dddd-4"]
    assert ids("--campaign", "spring") == ["aaaa-1", "aabb-2"]
    assert ids("--outcome", "tripped") == ["aabb-2"]
    assert ids("--since", "2026-09-30") == ["cccc-3", "dddd-4"]
    assert ids("--until", "2026-09-30") == ["aaaa-1", "aabb-2", "cccc-3"]
    assert ids("--until", "2026-09-30T20:00") == ["aaaa-1", "aabb-2"]
    assert ids("--since", "2026-03-02", "--until", "2026-10-01", "--thruster", "T1") == ["cccc-3"]
    assert ids("--limit", "2") == ["cccc-3", "dddd-4"]
    assert ids("--thruster", "T9") == []
    assert ids("spring-1") == ["aaaa-1", "aabb-2"]
    assert ids("--what", "campaigns") == ["spring-1", "autumn-1"]
    assert ids("--what", "campaigns", "--thruster", "T2") == ["spring-1"]
    assert len(ids("--what", "diagnoses", "--outcome", "ambiguous")) == 1
    assert "is no date" in run("list", "--since", "March", status=2).err
    assert "is not a folder" in run("list", "nowhere", status=2).err


def test_a_line_each_below_each_other(run):
    said = run("list")
    lines = said.out.splitlines()
    assert len(lines) == 5
    assert len({line.index("tunnel") if "tunnel" in line else line.index("vehicle") for line in lines[1:]}) == 1
    assert lines[1].startswith("2026-03-01 10:00  aaaa-1")
    assert lines[-1].rstrip().endswith("boat.h5")
    assert said.err == "4 recordings\n"
    assert "1 of 2 thrusters measured: T1, T2" in run("list", "--what", "campaigns").out
    assert "C 0.4 +- 0.002 N/V^2" in run("list", "--what", "fits").out
    assert "dead_band" in run("list", "--what", "twins").out
    assert "gain_std 0.1 %, in 4 recordings of T1, T2, boat" in run("list", "--what", "calibrations").out
    assert "no recordings in ." in run("list", "--thruster", "T9").out


def test_escape_sequences_are_shown_and_keep_their_line(data, run):
    recording(data / "evil.h5", "eeee-5", "T\x1b[31m\n2026-01-01 forged", campaign="\u202egnp")
    (data / "evil.h5").rename(data / "ev\x1bil.h5")
    for arguments in (["list"], ["show", "eeee"], ["show", "eeee", "--json", "-"], ["list", "--json", "-"]):
        said = run(*arguments)
        assert "\x1b" not in said.out + said.err
        assert "\u202e" not in said.out
    assert len(run("list").out.splitlines()) == 6
    assert "\\u001b[31m 2026-01-01 forged" in run("list").out


def test_show_by_id_prefix_file_and_folder(run):
    text = run("show", "aaaa").out
    assert text.startswith("recording aaaa-1\n")
    for part in (
        "spring-1/T1.h5",
        "operator   Ada",
        "cell    thrust",
        "1 Hz",
        "gain_std 0.001",
        "fits of it",
        "twin.json",
    ):
        assert part in text, part
    assert "campaigns of it" in text
    assert run("show", "spring-1/T1.h5").out == text
    assert run("show", "T1.h5", "spring-1").out != ""
    assert "T2: tripped, T2.h5" in run("show", "spring-1").out
    assert "cccc-3" in run("show", "autumn-1/campaign.jsonl").out
    assert run("show", "spring-1/fits.json").out.startswith("fit ")
    assert run("show", "twin.json").out.startswith("twin ")
    assert "ambiguous" in run("show", "spring-1/d.json").out
    identity = json.loads(run("list", "--what", "calibrations", "--json", "-").out)["entries"][0]["id"]
    assert "boat.h5" in run("show", identity[:6]).out


def test_show_of_what_is_not_unique_or_not_there(run):
    assert "is the beginning of 2 ids: aaaa-1 (recordings), aabb-2 (recordings)" in run("show", "aa", status=2).err
    missing = run("show", "aaaa-7", status=2).err
    assert "neither a file nor the beginning of an id" in missing
    assert "aaaa-1" in missing
    for found in ("aa", "aaaa-7", "", "%"):
        assert len(run("show", found, status=2).err.splitlines()) == 1


def test_show_of_a_copy_and_of_a_damaged_file(data, run):
    (data / "copy.h5").write_bytes((data / "boat.h5").read_bytes())
    (data / "bad.h5").write_text("no")
    assert "also at    copy.h5" in run("show", "dddd").out or "also at    boat.h5" in run("show", "dddd").out
    assert "is not an HDF5 file" in run("show", "bad.h5").out


def test_a_file_elsewhere_is_shown_with_what_lies_beside_it(data, run, monkeypatch):
    (data / "empty").mkdir()
    monkeypatch.chdir(data / "empty")
    assert "fits of it" in run("show", data / "spring-1" / "T1.h5").out


def test_every_key_of_the_json_is_on_the_page(run):
    seen = set(re.findall(r"`([^`\n]+)`", PAGE.read_text(encoding="utf-8")))

    def keys(value):
        if isinstance(value, dict):
            for key, part in value.items():
                yield key
                yield from () if key in ("parameters", "calibration", "attributes") else keys(part)
        elif isinstance(value, list):
            for part in value:
                yield from keys(part)

    whats = ("recordings", "campaigns", "fits", "twins", "diagnoses", "calibrations")
    told = [json.loads(run("list", "--what", what, "--json", "-").out) for what in whats]
    told += [json.loads(run("show", each, "--json", "-").out) for each in ("aaaa", "spring-1")]
    assert {key for document in told for key in keys(document)} <= seen
