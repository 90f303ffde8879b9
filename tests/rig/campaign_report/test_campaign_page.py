"""The page of a completed, a tripped and a damaged campaign, read as a browser would."""

import json
import re
import shutil
from itertools import pairwise

import pytest
from click.testing import CliRunner

from rig.campaign_report.answers import earlier
from rig.campaign_report.command import REPORT_FILE, Wanted, page_text, report_command
from rig.cli import main
from rig.errors import RecordingError
from rig.fit.command import fit_command
from tests.rig.campaign_report.played_campaigns import NOTES
from tests.rig.report_reading import read

SECTIONS = (
    *("Results", "How it went", "T1", "T3", "Earlier campaigns", "Environment", "Operator and notes", "Calibration"),
    *("Configuration", "Versions and provenance", "Signature"),
)
QUICK = Wanted(None)


def silent(text):
    pass


def page(folder):
    return page_text(folder, QUICK, silent)


@pytest.fixture(scope="module")
def whole(completed):
    return page(completed)


def headings(text):
    return [(int(level), name) for level, name in re.findall(r"<h(\d)[^>]*>(.*?)</h\d>", text)]


def test_all_sections_are_there_their_headings_in_order(whole):
    found = headings(whole)
    assert tuple(name for level, name in found if level == 2) == SECTIONS
    assert [level for level, _ in found].count(1) == 1
    assert all(after <= before + 1 for (before, _), (after, _) in pairwise(found)), "no level is left out"


def test_it_is_self_contained_and_readable_without_eyes(whole):
    found = read(whole)
    assert '<html lang="en">' in whole
    assert found.tags.count("caption") == found.tags.count("table") > 5
    assert len(found.labels) >= found.tags.count("svg") > 8
    assert all(label.strip() for label in found.labels)
    assert len(re.findall(r"<th[ >]", whole)) == len(re.findall(r"<th scope=", whole))


def test_its_numbers_are_those_of_the_fit(completed, whole):
    ran = CliRunner().invoke(fit_command, [str(completed), "--json", "-"])
    for fit in json.loads(ran.stdout)["fits"]:
        C, (tare,) = fit["parameters"]["C"], fit["tare"].values()
        value, half = re.search(rf">{fit['thruster']}</th>.*?C = ([\d.]+) ± ([\d.]+) N/V²", whole, re.DOTALL).groups()
        assert float(value) == pytest.approx(C["value"], abs=1e-5)
        assert float(half) == pytest.approx(2 * C["std"], abs=1e-5)
        row = re.search(rf">{fit['thruster']}</th>.*?</tr>", whole, re.DOTALL)[0]
        cells = dict(re.findall(r'data-label="([^"]+)"[^>]*>([^<]*)<', row))
        assert float(cells["tare / N"]) == pytest.approx(tare["value"], abs=1e-3)
        assert cells["χ²/dof"] == f"{fit['chi2_per_dof']:.2f}"
        assert cells["points"] == str(fit["n"])


def test_what_operators_write_is_shown_and_never_obeyed(whole):
    found = read(whole)
    assert "<script" not in whole
    assert "<b>" not in whole
    assert NOTES in found.text
    assert "<script>alert('A. Nyman')</script>" in found.text


def test_it_is_compared_with_the_campaign_before_it(completed, tripped, whole):
    assert [path.parent for path in earlier(completed)] == [tripped]
    assert earlier(tripped) == []
    assert f"Compared with {tripped.name}" in read(whole).text
    assert "No earlier campaign" in read(page(tripped)).text


def test_environment_calibration_and_configuration(whole):
    text = read(whole).text
    for told in ("simulated tunnel", "Not recorded: water temperature", "WXS-SIM 500 N, serial number", "0.0005",
                 "max_voltage = 24.0", "voltages = [8.0", "thruster-rig 0", "Checked by"):  # fmt: skip
        assert told in text, told


def test_the_same_campaign_gives_the_same_bytes(completed, whole):
    assert page(completed) == whole


def test_a_tripped_campaign_says_what_ended_it_and_what_lacks(tripped):
    text = read(page(tripped)).text
    assert "TRIPPED" in text
    assert "load_cell.thrust is stale" in text
    assert "1 of 2 thrusters measured to the end, not T3" in text
    assert f"rig resume {tripped.name} goes on with it" in text


def test_a_damaged_recording_is_told_and_the_rest_too(damaged, whole):
    text = read(page(damaged)).text
    assert "T3: no fit" in text
    assert "nothing of it is in the figures below" in text
    assert "rig recover T3.h5" in text
    told = re.compile(r"C = 0\.41\d+ ± [\d.]+ N/V²")
    assert told.findall(text)[0] == told.findall(read(whole).text)[0], "T1 is told as if nothing had happened"


def test_a_recording_that_was_changed_after_it_was_closed_is_told(completed, tmp_path):
    folder = shutil.copytree(completed, tmp_path / completed.name)
    file = folder / "T1.h5"
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    text = read(page(folder)).text
    assert "T1.h5 is not what was closed" in text
    assert "a recording of T1 is damaged or was changed" in text


def test_a_folder_whose_ledger_is_damaged_is_told_by_its_recordings(completed, tmp_path):
    folder = shutil.copytree(completed, tmp_path / completed.name)
    (folder / "campaign.jsonl").write_text("no ledger\n", encoding="utf-8")
    text = read(page(folder)).text
    assert "Read without its ledger" in text
    assert "C = 0.41" in text
    assert "voltages = [8.0" in text


def test_a_folder_without_a_campaign_is_refused(tmp_path, capsys):
    assert main(["report", str(tmp_path)]) == 2
    assert "expected a campaign folder with campaign.jsonl" in capsys.readouterr().err
    with pytest.raises(RecordingError, match="expected a campaign folder"):
        page(tmp_path)


def test_the_command_writes_into_the_folder_and_takes_an_earlier_campaign(completed, tripped, tmp_path, capsys):
    out = tmp_path / "page.html"
    assert main(["report", str(completed), "-o", str(out), "--no-diagnosis", "--earlier", str(tripped)]) == 0
    assert "Not made: it was left out (--no-diagnosis)" in read(out.read_text(encoding="utf-8")).text
    assert main(["report", str(completed), "--no-diagnosis", "--earlier", str(completed)]) == 2
    assert "expected fits.json in it" in capsys.readouterr().err
    assert not (completed / REPORT_FILE).exists()


def test_a_diagnosis_is_on_it_when_there_is_time(completed):
    text = read(page_text(completed, Wanted(60.0), silent)).text
    assert text.count("Adequate: no mismatch") == 2
    assert "Not made" not in text


def test_help_says_what_the_page_is():
    assert "kept, printed and signed" in CliRunner().invoke(report_command, ["--help"]).stdout
