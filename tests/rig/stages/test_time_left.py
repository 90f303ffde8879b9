"""What the console calls the time left, and `rig check` the duration, is what a campaign then takes."""

import pytest

from rig.safety.watchdog_proof import PROOFS_OF_A_RUN
from tests.rig.stages.played import outcome, play
from tests.rig.virtual_bench import PLAN, virtual


@pytest.mark.parametrize("proving", [True, False])
def test_time_left_counts_every_proof_of_every_run(tmp_path, proving):
    with virtual(tmp_path, thrusters=("T1", "T2"), prove_watchdog=proving) as world:
        seen = play(world)
        assert outcome(world) == ("completed", "")
        told = world.session.status
    told_at = [(s.progress.elapsed, s.progress.eta) for s in seen if s.progress and s.state not in ("mount", "done")]
    began, whole = told_at[0]
    plan, proofs = PLAN.duration().expected, PROOFS_OF_A_RUN + 1 if proving else 0
    assert whole == pytest.approx(2 * plan + proofs * told.proof_expected, abs=0.1)
    assert (told.proof_expected > 0) is proving
    took = told_at[-1][0] - began
    assert took == pytest.approx(whole, rel=0.25), "the proof by itself is quicker than half of its limit, rest is not"
