from xml.etree import ElementTree as ET

import numpy as np
import pytest

from identification.velocity.velocity import Window, derivative
from rig.report.page import html
from rig.report.style import svg
from rig.vehicle.report.velocity import draw_velocity, velocity_example, velocity_page
from tests.rig.report_reading import open_fonts, read


@pytest.fixture(scope="module", autouse=True)
def fonts():
    open_fonts()


def test_example_is_drawn(tmp_path):
    paths = velocity_example(np.random.default_rng(1), tmp_path / "figures")
    assert [path.name for path in paths] == ["velocity-signal.svg", "velocity-estimate.svg"]
    for path in paths:
        assert path.stat().st_size > 10_000
        assert ET.parse(path).getroot().tag == "{http://www.w3.org/2000/svg}svg"


def test_truth_unknown_is_one_plot():
    t = np.arange(50.0)
    drawn = svg(draw_velocity(derivative(t, np.sin(t / 9), Window(3, 3), 2), None))
    assert "velocity / (m/s)" in drawn
    assert "error" not in drawn


def test_page_of_the_worked_example():
    page = velocity_page(np.random.default_rng(1))
    found = read(html(page))
    assert "0.1963" in found.text
    assert page.lead.startswith("The filter's velocity is off by 0.0")
    assert found.tags.count("svg") == 4
