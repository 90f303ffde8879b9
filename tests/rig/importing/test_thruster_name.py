"""Whose run it is: said, by the map, by the file's name; asked for where nothing tells."""

from dataclasses import replace
from pathlib import Path

import pytest

from rig.errors import ConfigError
from rig.importing.mapping import read_map
from rig.importing.thruster_name import thruster_of

NOBODYS = read_map("effort_static")


@pytest.mark.parametrize(
    ("name", "thruster"),
    [
        ("T1.csv", "T1"),
        ("2026-03-01_T3_bollard.csv", "T3"),
        ("t200_18v_data.csv", "t200"),
        ("M5-static.csv", "M5"),
        ("run 7 thruster_2.csv", "thruster_2"),
        ("Thruster3.log", "Thruster3"),
    ],
)
def test_names_that_files_have(name, thruster):
    assert thruster_of(None, NOBODYS, Path(name)) == (thruster, "the file's name")


@pytest.mark.parametrize("name", ["run7.csv", "TEST12.csv", "data_t1.csv", "2statem2V.csv", "14FEB_LakeTest_Run1.csv"])
def test_names_that_tell_nothing_are_asked_about(name):
    with pytest.raises(ConfigError, match="whose run is it"):
        thruster_of(None, NOBODYS, Path(name))


def test_what_is_said_comes_before_the_map_and_the_map_before_the_name():
    named = replace(NOBODYS, thruster="M5")
    assert thruster_of("T9", named, Path("T1.csv")) == ("T9", "--thruster")
    assert thruster_of(None, named, Path("T1.csv")) == ("M5", "the map")
