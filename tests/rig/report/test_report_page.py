import numpy as np
import pytest

from rig.report.mismatch_figures import Grid, Panel, Region, before_after, grid_of, residual_map, signature, spectrum
from rig.report.page import Page, Picture, Remark, Section, Sentences, Table, html, write
from rig.report.regression_figures import Curve, Group, Interval, NormalOrder, fit_band, forest, normal_plot, residuals
from rig.report.regression_figures import singular_values as lollipops
from rig.report.style import PALETTE, Plot, drawable, labels, standalone, svg
from rig.vehicle.report.figures import Simulated, drag_curve, inertia_line, simulated_trial
from tests.rig.report_reading import open_fonts, read

NASTY = "T1 <script>alert('x')</script> & \"$x$\" _y"
X = np.linspace(-2.0, 2.0, 9)
FEW = Group("measured", X, X * abs(X), np.full(9, 0.1))
CURVE = Curve("C V|V|", X, X * abs(X), X * abs(X) - 0.2, X * abs(X) + 0.2)
PHONE = 390 - 2 * 14.4
"""px, width of a figure on a phone, where letters of 11 px are asked for."""
LONG = np.linspace(0.0, 30.0, 3000)


@pytest.fixture(scope="module", autouse=True)
def fonts():
    open_fonts()


def page_of(*parts, lead="All is well.", contents=False):
    return Page(NASTY, lead, (Section(NASTY, parts, NASTY), Section("Other", ())), contents=contents)


def plots():
    many = Group("many", LONG, np.sin(LONG))
    names = [Group(f"recording {i}", X, i * X) for i in range(6)]
    grid = grid_of(LONG, 10 * np.sin(LONG), np.cos(LONG))
    empty = Grid(np.arange(3.0), np.arange(3.0), np.full((2, 2), np.nan))
    rows = [Interval("a", 1.0, 0.5, 1.5), Interval("b", 2.0, np.nan, np.nan), Interval("c", np.nan, np.nan, np.nan)]
    return {
        "fit": fit_band([FEW], CURVE, "x / V", "y / N"),
        "fit of many": fit_band([many], Curve("m", X, X), "x / V", "y / N"),
        "fit of several with many": fit_band([many, many], CURVE, "x / V", "y / N"),
        "residuals of more runs than markers": residuals(names, "x / V", "y / N", CURVE, wide=True),
        "residuals without band": residuals([FEW], "x / V", "y / N"),
        "normal": normal_plot(NormalOrder(X, X, X - 1, X, X + 1)),
        "singular values": lollipops(np.array([1e4, 3.0, 0.0]), np.inf),
        "singular values, many": lollipops(np.geomspace(1e4, 1.0, 20), 1e4),
        "forest": forest(rows, "value / N", 1.0),
        "forest without reference": forest(rows[:1], "value / N"),
        "map": residual_map(grid, Region("above 5 V", voltage=(5.0, 10.0))),
        "map with a span of time": residual_map(grid, Region("late", time=(20.0, 30.0))),
        "map of nothing": residual_map(empty),
        "signature": signature(FEW, CURVE, "x / V", "y / N"),
        "signature with rival": signature(FEW, CURVE, "x / V", "y / N", Curve("rival", X, X)),
        "before and after": before_after(Panel("run", LONG, np.sin(LONG), 0 * LONG, np.sin(LONG) + 0.1), "y / N"),
        "spectrum": spectrum([Group("before", LONG[1:], LONG[1:])], "f / Hz", "power / N²"),
        "drag": drag_curve(FEW, Group("promised", X, 2 * X), CURVE, "v / (m/s)", "force / N"),
        "drag without efficiency": drag_curve(FEW, None, CURVE, "v / (m/s)", "force / N"),
        "trial": simulated_trial(Simulated("sine", LONG, np.sin(LONG), np.sin(LONG)), "x / m"),
        "inertia": inertia_line(many, CURVE, "force / N", "acceleration / (m/s²)"),
    }


@pytest.mark.parametrize("name", plots())
def test_every_figure(name):
    plot = plots()[name]
    drawn = svg(plot)
    assert drawn.startswith("<svg viewBox=")
    assert "mathdefault" not in drawn
    assert not [colour.light for colour in PALETTE if f": {colour.light}" in drawn]
    assert plot.alt.endswith(".")
    sizes = {float(part.split("px")[0]) for part in drawn.split("font-size: ")[1:]}
    assert min(sizes) * PHONE / (plot.size[0] * 72) >= 11.0


def test_page_is_well_formed_escaped_and_self_contained():
    table = Table(NASTY, ("name", NASTY), ((NASTY, "1"), ("b", "")))
    folded = Table("All points", ("n",), (("1",),), folded=True)
    tones = Sentences((NASTY, Remark("good", "good"), Remark("doubt", "doubt"), Remark("bad", "bad")))
    all_of_them = [Picture(NASTY, plot, NASTY) for plot in list(plots().values())[:3]]
    text = html(page_of(table, folded, tones, *all_of_them, Section("Inner", (tones,)), lead=NASTY, contents=True))
    found = read(text)
    assert "<script>" not in text
    assert found.text.count(NASTY) >= 8
    assert found.tags.count("svg") == 3
    assert found.tags.count("caption") == 2
    assert text.count('role="img" aria-label="') == 3
    assert "Content-Security-Policy" in text
    assert all(f'class="{tone}"' in text for tone in ("good", "doubt", "bad"))


def test_names_in_figures_are_escaped_and_taken_literally():
    drawn = svg(fit_band([Group(NASTY[1:], X, X)], CURVE, NASTY, "y / N"))
    assert "<script>" not in drawn
    assert "&lt;script&gt;" in drawn
    assert "$x$" in drawn


def test_same_page_same_bytes_on_disk(tmp_path):
    page = page_of(Picture("a", plots()["map"]), Picture("b", plots()["fit"]), Picture("c", plots()["fit"]))
    for name in ("one.html", "folder/two.html"):
        write(page, tmp_path / name)
    one = (tmp_path / "one.html").read_bytes()
    assert one == (tmp_path / "folder" / "two.html").read_bytes()
    assert len(set(read(one.decode()).ids)) > 4


def test_file_of_its_own_has_its_name_spaces():
    drawn = standalone(plots()["fit"])
    assert drawn.startswith("<?xml")
    assert 'xmlns="http://www.w3.org/2000/svg"' in drawn
    assert "xlink:href" in drawn


def test_row_of_another_length_than_its_head_is_refused():
    with pytest.raises(ValueError, match="has not the 2 cells"):
        Table("t", ("a", "b"), (("1",),))


def test_long_line_keeps_its_peaks():
    y = np.zeros(10_000)
    y[4321], y[77] = 5.0, -3.0
    x, kept = drawable(np.arange(10_000.0), y)
    assert x.size < 1300
    assert (kept.min(), kept.max()) == (-3.0, 5.0)


def test_logarithmic_axes_have_plain_labels():
    def draw(figure):
        axes = figure.subplots()
        axes.plot([1, 1e6], [1e-6, 1])
        axes.set_xscale("log")
        axes.set_yscale("log")
        labels(axes, "f / Hz", "power")

    drawn = svg(Plot(draw, "a line."))
    assert "10⁻⁴" in drawn
    assert "mathdefault" not in drawn
