"""Campaigns that are played once for all tests of their pages."""

import shutil

import pytest

from rig.campaign_report.answers import FIT_FILE
from rig.operate.summary import print_summary
from tests.rig.campaign_report.played_campaigns import played
from tests.rig.report_reading import open_fonts


@pytest.fixture(scope="session", autouse=True)
def fonts():
    open_fonts()


@pytest.fixture(scope="session")
def tripped(tmp_path_factory):
    """T1 came to its end; the load cell fell silent under T3. The older of the two."""
    folder = played(tmp_path_factory.mktemp("campaigns"), "tunnel-20260101-101500", broken="T3", seed=2, day="01")
    print_summary(sorted(folder.glob("*.h5")), folder)
    assert (folder / FIT_FILE).is_file()
    return folder


@pytest.fixture(scope="session")
def completed(tripped):
    """Both thrusters, in the same output folder."""
    return played(tripped.parent, "tunnel-20260112-101500")


@pytest.fixture(scope="session")
def damaged(completed, tmp_path_factory):
    """A copy of the completed one, whose second recording lost nearly all of itself, and whose folder was moved."""
    folder = tmp_path_factory.mktemp("moved") / completed.name
    shutil.copytree(completed, folder)
    file = folder / "T3.h5"
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 50])
    return folder
