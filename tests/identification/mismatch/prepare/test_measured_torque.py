"""A recorded torque decides between a cell that feels it and a thruster whose directions differ."""

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.model.data import Data
from identification.mismatch.pipeline import diagnose
from identification.mismatch.prepare.channels import torque
from identification.mismatch.prepare.grid import Held
from identification.mismatch.prepare.preparing import history_of
from identification.mismatch.prepare.scales import scale_of
from identification.mismatch.select.forward_selection import available
from identification.physics.torque_crosstalk import MeasuredTorque, TorqueCrosstalk
from identification.recording import Channel
from identification.run_history.remembered import RememberedRun
from rig.diagnose.report.rivals import told_apart
from tests.identification.diagnosed_runs import TOP, levels, run

FULL = 3.0
"""N m at TOP; full thrust is 72 N."""
SECONDS, RATE = 150.0, 30.0


def turning(seed, reverse, startup):
    """(n,) s and N m of a propeller whose torque differs by direction, and holds the rotor's inertia after a step."""
    start, level = levels(seed, SECONDS)
    t = np.arange(0.0, SECONDS, 1 / RATE)
    index = np.maximum(np.searchsorted(start, t, side="right") - 1, 0)
    V, jump = level[index], np.diff(level, prepend=0.0)[index]
    Q = FULL * V * np.abs(V) / TOP**2 * np.where(V < 0, reverse, 1.0)
    return t, Q + startup * FULL * jump / TOP * np.exp(-(t - start[index]) / 0.2)


def recorded(ratio=1.0, c=0.0, seed=0, reverse=0.9, startup=0.3, noise=0.03):
    """Thrust of which `ratio` is left in reverse, + c times the torque, and a noisy torque channel."""
    t, Q = turning(seed, reverse, startup)
    value = Q + noise * np.random.default_rng([seed, 3]).standard_normal(t.size)
    channel = Channel("torque", "cell", "torque", "N.m", t, value)
    return run(lambda _t, V, F: np.where(V < 0, ratio, 1.0) * F + c * Q, seed=seed, seconds=SECONDS, extra=(channel,))


def within(value, true):
    low, high = value.interval
    assert low < true < high


@pytest.fixture(scope="module")
def felt():
    return diagnose([recorded(c=1.0)])


def test_a_cell_that_feels_the_recorded_torque_is_named_with_its_coefficient(felt):
    (finding,) = felt.findings
    assert (felt.verdict, finding.effect, finding.form, finding.rivals) == (
        "explained",
        "torque_crosstalk",
        "measured",
        (),
    )
    within(finding.parameters["coefficient"], 1.0)
    assert finding.parameters["coefficient"].unit == "1/m"
    assert "N per N m of the measured torque" in finding.statement
    assert "torque" in {m.where.quantity for m in felt.mismatch}
    assert felt.heldout.after < felt.heldout.before
    assert felt.twin.terms[0].scale.torque == pytest.approx(0.95 * FULL, rel=0.05)


@pytest.mark.parametrize("reverse", [1.0, 0.9])
def test_an_asymmetric_thruster_is_named_where_a_torque_was_recorded(reverse):
    """On thrust alone torque cross-talk is an equal rival (test_mismatch_diagnose)."""
    found = diagnose([recorded(ratio=0.93, reverse=reverse)])
    (finding,) = found.findings
    assert (found.verdict, finding.effect, finding.rivals) == ("explained", "asymmetry", ())
    within(finding.parameters["ratio"], 0.93)
    assert found.next_experiment is None


def test_both_at_once_are_told():
    found = diagnose([recorded(ratio=0.93, c=1.0)])
    known = {f.effect: f for f in found.findings}
    assert (found.verdict, set(known)) == ("explained", {"asymmetry", "torque_crosstalk"})
    within(known["asymmetry"].parameters["ratio"], 0.93)
    within(known["torque_crosstalk"].parameters["coefficient"], 1.0)


def test_where_only_the_directions_of_the_torque_differ_a_small_difference_stays_open():
    """Steady levels of a torque that is 20 % smaller in reverse: c Q and a ratio of 0.992 are one curve."""
    found = diagnose([recorded(c=1.0, reverse=0.8, startup=0.0, noise=0.02)])
    assert found.verdict == "ambiguous"
    (finding,) = found.findings
    assert {finding.effect, *(r.effect for r in finding.rivals)} == {"asymmetry", "torque_crosstalk"}
    assert found.next_experiment is not None
    assert "dead weights on the cell" in found.next_experiment.why
    assert "torque channel" not in found.next_experiment.why, "it is recorded already"


@pytest.mark.parametrize("seed", [0, 1])
def test_a_noisy_torque_that_the_cell_does_not_feel_is_no_finding(seed):
    found = diagnose([recorded(seed=seed, noise=0.3)])
    assert (found.verdict, found.findings) == ("adequate", ())


def test_the_measured_form_takes_the_place_of_the_proxy():
    def forms(*recordings):
        histories = tuple(history_of(r) for r in recordings)
        data = Data(histories, scale_of([RememberedRun(h) for h in histories], 0.5))
        return [t for t in available(data) if t.id == "torque_crosstalk"]

    one, bare = recorded(), run(seed=5)
    assert forms(one) == [MeasuredTorque()]
    assert forms(bare) == [TorqueCrosstalk()]
    assert forms(one, bare) == [TorqueCrosstalk()], "not recorded in every run"
    dead = replace(
        one, channels=tuple(replace(c, value=0 * c.value) if c.quantity == "torque" else c for c in one.channels)
    )
    assert forms(dead) == [TorqueCrosstalk()], "a channel of zeros"


def test_the_noise_of_a_torque_is_averaged_between_steps():
    t, Q = turning(0, 0.9, 0.0)
    noisy = Q + 0.1 * np.random.default_rng(1).standard_normal(t.size)
    command = recorded().first_of("command_voltage")
    held = Held(command, float(t[-1]))
    edges = t - 0.5 / RATE
    driven = held.mean(edges)
    found = torque(Channel("torque", "cell", "torque", "N.m", t, noisy), held, edges, driven)
    true = FULL * driven * np.abs(driven) / TOP**2 * np.where(driven < 0, 0.9, 1.0)
    inside = np.abs(t[:-1, None] - held.time).min(axis=1) > 0.5
    assert np.std((found - true)[inside]) < 0.3 * 0.1


def test_a_report_asks_for_no_channel_that_is_there():
    assert "torque channel" in told_apart("asymmetry", "torque_crosstalk")
    assert "torque channel" not in told_apart("asymmetry", "torque_crosstalk", "", "measured")
