"""The design of the blind proof: every cell, every draw, one world."""

from dataclasses import replace

import pytest

from rig.blind.design import design, matches
from rig.blind.workers import concealable
from sim_devices.concealed import NOISE_KINDS, WIDE_NOISE_KINDS
from sim_devices.concealed.sealing.on_disc import conceal
from sim_devices.tables import WorldError
from tests.rig.blind_scores import CATALOGUE, WORLD


def test_the_design_has_every_cell_and_breaks_off_evenly():
    jobs = design(WORLD, CATALOGUE, 6)
    orders = [o.id for job in jobs for o in job.orders]
    assert len(set(orders)) == len(orders)
    assert len({job.token for job in jobs}) == len(jobs)
    cells = {o.split("/")[0] for o in orders}
    assert cells >= {
        "faint",
        "clear",
        "plain",
        "removed",
        "outside",
        "form",
        "variant",
        "fault",
        "pair",
        "clean",
        "power_2.3",
    }
    half_done = [job.id for job in jobs[: len(jobs) // 2]]
    for label in ("faint/dead_band", "plain/heating", "outside/fouling", "fault/frozen"):
        assert 2 <= sum(name.startswith(f"{label}/") for name in half_done) <= 4
    assert sum(name.startswith("clean/") for name in orders) == 300
    assert all(not set(job.token) - set("0123456789abcdef") for job in jobs)  # the token tells nothing


def test_the_physics_that_is_taken_out_is_asked_of_the_same_recording():
    (job,) = [job for job in design(WORLD, CATALOGUE, 1) if job.id == "plain/heating/0"]
    assert [(o.id, o.without) for o in job.orders] == [("plain/heating/0", ()), ("removed/heating/0", ("heating",))]
    assert "heating" not in job.spec["rivals"]
    (only,) = design(WORLD, CATALOGUE, 1, ["removed/heating"])
    assert [o.id for o in only.orders] == ["removed/heating/0"]
    assert (only.token, only.seed) == (job.token, job.seed)


def test_another_draw_has_the_same_orders_and_other_cases():
    first, second = (design(WORLD, CATALOGUE, 2, draw=draw) for draw in ("", "autumn"))
    assert [job.id for job in first] == [job.id for job in second]
    assert [o for job in first for o in job.orders] == [o for job in second for o in job.orders]
    assert not {job.token for job in first} & {job.token for job in second}
    assert not {tuple(job.seed) for job in first} & {tuple(job.seed) for job in second}
    pairs = [[job.spec["effects"] for job in jobs if job.id.startswith("pair/")] for jobs in (first, second)]
    assert pairs[0] != pairs[1]


def test_a_case_is_of_one_world(tmp_path):
    (job,) = design(replace(WORLD, version="abc"), CATALOGUE, 1, ["plain/heating"])
    assert job.asked()["world"] == "abc"
    with pytest.raises(WorldError, match="asked was abc"):
        conceal(job.asked(), tmp_path)
    assert job.digest != replace(job, world="abd").digest


def test_wide_noise_is_a_cell_of_its_own_and_changes_no_other():
    wide = replace(WORLD, wide_noise=("wide_slow", "wide_mixture"))
    before, after = (design(world, CATALOGUE, 20) for world in (WORLD, wide))
    more = [job for job in after if job.id.startswith("wide/")]
    assert [job for job in after if job not in more] == before
    assert {job.spec["noise"]: sum(j.spec == job.spec for j in more) for job in more} == {
        "wide_slow": 250,
        "wide_mixture": 250,
    }
    assert concealable().wide_noise == WIDE_NOISE_KINDS
    assert concealable().noise == NOISE_KINDS


def test_orders_are_asked_for_by_pattern():
    assert matches("clean/white/12", ["clean/white/12"])
    assert matches("clean/white/12", ["faint", "clean/*"])
    assert not matches("clean/white/12", ["clean/white/1"])
