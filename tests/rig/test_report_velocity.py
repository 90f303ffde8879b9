from io import BytesIO
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from matplotlib.figure import Figure

from identification.velocity import Window, derivative
from rig.report.velocity import draw_velocity, velocity_example


@pytest.fixture(scope="module", autouse=True)
def fonts():
    """matplotlib keeps the font files it has drawn with open; here they are opened before open files are counted."""
    figure = Figure()
    figure.suptitle("a – b")
    figure.savefig(BytesIO())


def test_example_is_drawn(tmp_path):
    for suffix in ("svg", "png"):
        paths = velocity_example(np.random.default_rng(1), tmp_path / "figures", suffix)
        assert [path.name for path in paths] == [f"velocity-signal.{suffix}", f"velocity-estimate.{suffix}"]
        assert all(path.stat().st_size > 10_000 for path in paths)
    assert ET.parse(tmp_path / "figures" / "velocity-estimate.svg").getroot().tag.endswith("svg")


def test_truth_unknown_is_one_plot():
    t = np.arange(50.0)
    figure = draw_velocity(derivative(t, np.sin(t / 9), Window(3, 3), 2), None)
    assert len(figure.axes) == 1
