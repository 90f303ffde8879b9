"""The page on paper: a sentence without the extra, and with it a PDF that holds the page."""

from importlib.util import find_spec

import pytest

from rig.campaign_report.pdf import require_pdf, write_pdf
from rig.cli import main
from rig.errors import ConfigError
from rig.report.page import Page, Section, Sentences, html

THERE = find_spec("weasyprint") is not None


@pytest.mark.skipif(THERE, reason="the extra is installed")
def test_without_the_extra_a_sentence_names_it_before_anything_is_computed(tmp_path, capsys):
    with pytest.raises(ConfigError, match=r"pip install 'thruster-rig\[pdf\]'"):
        require_pdf("--pdf")
    assert main(["report", str(tmp_path), "--pdf", str(tmp_path / "x.pdf")]) == 2
    assert "--pdf: weasyprint sets the PDF and is not installed here" in capsys.readouterr().err


@pytest.mark.skipif(not THERE, reason="needs the extra pdf")
def test_with_the_extra_the_page_is_a_pdf(tmp_path):
    write_pdf(
        html(Page("Campaign", "All is well.", (Section("Found", (Sentences(("C = 0.4",)),)),))), tmp_path / "x.pdf"
    )
    assert (tmp_path / "x.pdf").read_bytes().startswith(b"%PDF-")
