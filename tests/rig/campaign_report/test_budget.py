"""The uncertainty budget against least squares written out, and its sum against the fit's own standard deviation."""

import numpy as np
import pytest

from rig.campaign_report.budget import COVERAGE, budgets
from rig.fit.answer import fit_recordings
from tests.rig.campaign_report.hold_recordings import ONE, recording


def budget(*recordings):
    (answer,) = fit_recordings(recordings)
    (found,) = budgets(answer.fit, recordings)
    return answer.fit, found


def test_contributions_sum_to_what_the_fit_states():
    fit, found = budget(recording(calibration={"gain_std": 0.001}))
    assert [part.kind for part in found.contributions] == ["A", "A", "B"]
    assert found.u == pytest.approx(fit.parameters["C"].std, rel=1e-12)
    assert found.expanded == COVERAGE * found.u
    assert sum(found.share(part) for part in found.contributions) == pytest.approx(100.0)
    assert found.contributions[2].u == pytest.approx(0.001 * found.value)


def test_the_part_of_the_tare_is_what_would_go_if_it_were_known():
    """Weighted least squares of the same points: with the tare fitted, and with the tare taken from above."""
    fit, found = budget(recording(levels=ONE))
    rows = fit.estimate.rows
    H, weight = rows.H, 1 / rows.std_error**2
    both = np.linalg.inv(H.T @ (weight[:, None] * H))
    alone = 1 / float(weight @ H[:, 0] ** 2)
    share = 1 - alone / both[0, 0]
    scatter, tare = found.contributions
    assert share > 0.2
    assert tare.u**2 / (tare.u**2 + scatter.u**2) == pytest.approx(share, rel=0.02)


def test_a_calibrated_voltage_counts_twice_and_one_that_states_nothing_is_told():
    _, silent = budget(recording(calibration={"gain_std": 0.001}))
    assert silent.open == (
        "Nothing is stated of the error of the command voltage: it is not in this sum. 1 % of it would be 2 % of C.",
    )
    _, stated = budget(recording(calibration={"gain_std": 0.001}, measured={"gain_std": 0.002}))
    assert stated.open == ()
    assert stated.contributions[-1].u == pytest.approx(2 * 0.002 * stated.value)


def test_a_cell_without_a_stated_gain_is_told():
    _, found = budget(recording())
    assert "states no gain_std" in found.open[0]


def test_several_recordings_have_a_tare_each():
    fit, found = budget(recording("a"), recording("b"))
    assert len(fit.tare) == 2
    assert found.u == pytest.approx(fit.parameters["C"].std, rel=1e-12)
    assert found.contributions[1].u > 0
