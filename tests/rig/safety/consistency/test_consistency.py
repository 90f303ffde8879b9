"""Command against rotation, current and thrust, on constructed ticks: what passes, what does not, and how soon."""

import pytest

from rig.safety.consistency.look import Look
from tests.rig.safety.consistency.thruster import TICK, Thruster, from_then_on

STAIRS = (8.0, -8.0, 12.0, -12.0, 8.0, 16.0, -16.0, 0.0)


@pytest.mark.parametrize(
    "thruster",
    [
        Thruster(),
        Thruster(astern=0.6),
        Thruster(lag=0.3),
        Thruster(lambda _, look: look._replace(rate=-look.rate, thrust=-look.thrust)),
        Thruster(lambda _, look: look._replace(current=None)),
        Thruster(lambda _, look: look._replace(rate=None)),
        Thruster(lambda time, look: look if round(time / TICK) % 4 else look._replace(rate=None, thrust=None)),
        Thruster(lambda time, look: look._replace(thrust=look.thrust * (1 + 0.004 * time))),
    ],
    ids=["plain", "weak astern", "slow", "wired the other way", "no current", "no rate", "slow rows", "drifts"],
)
def test_a_sound_thruster_passes(thruster):
    assert thruster.play(STAIRS) is None


@pytest.mark.parametrize("factor", [2.0, 0.5, 0.6, -1.0, 0.0])
@pytest.mark.parametrize(("channel", "what"), [("thrust", "the thrust"), ("rate", ""), ("current", "the current")])
def test_a_factor_that_changes_in_a_hold_is_found_within_its_time(channel, what, factor):
    """At 7.8 s the second level, 12 V, has been held for 1.8 s."""
    thruster = Thruster(from_then_on(7.8, **{channel: lambda value: value * factor}))
    found = thruster.play((8.0, 12.0))
    assert found is not None
    assert found[0] - 7.8 <= 0.7
    assert what in found[1]
    assert "while the command stood still" in found[1]


@pytest.mark.parametrize("factor", [2.0, 0.5, 0.6, -1.0])
def test_a_factor_that_changes_between_holds_is_found_at_the_next_level_that_is_known(factor):
    thruster = Thruster(from_then_on(9.0, thrust=lambda value: value * factor))
    assert thruster.play((8.0, 12.0)) is None
    begun = thruster.time
    time, cause = thruster.hold(8.0, 3.0) or (0.0, "")
    assert 0.0 < time - begun <= 1.3
    assert "are expected by what 8 V gave before" in cause


@pytest.mark.parametrize("factor", [1.2, 0.8])
def test_a_small_factor_passes(factor):
    assert Thruster(from_then_on(7.8, thrust=lambda value: value * factor)).play(STAIRS) is None


def test_an_inverted_rotation_is_no_other_direction():
    """The propeller is told to turn back, and its rotation keeps its sign: no level of that direction is known yet."""
    thruster = Thruster(from_then_on(6.5, rate=abs))
    _, cause = thruster.play((8.0, -8.0)) or (0.0, "")
    assert "the thrust is -" in cause


def test_thrust_that_is_stuck_with_noise_is_found_at_the_next_level():
    thruster = Thruster()

    def stuck(time: float, look: Look) -> Look:
        return look if time < 7.0 else look._replace(thrust=58.0 + 0.01 * (round(time / TICK) % 3))

    thruster.spoil = stuck
    time, cause = thruster.play((8.0, 12.0, -12.0)) or (0.0, "")
    assert 9.0 < time <= 9.0 + 1.3
    assert "the thrust is 57" in cause


def test_thrust_that_never_was_there_is_found_at_the_first_level_that_must_push():
    chance = Thruster().chance
    thruster = Thruster(lambda _, look: look._replace(thrust=chance.gauss(0.7, 0.02)))
    _, cause = thruster.play((4.0, 8.0, 12.0)) or (0.0, "")
    assert "the thrust does not follow" in cause
    assert "at 12 V" in cause


def test_thrust_that_stays_at_rest_is_found():
    thruster = Thruster()

    def stays(time: float, look: Look) -> Look:
        return look if time < 7.0 else look._replace(thrust=58.0 + 0.01 * (round(time / TICK) % 3))

    thruster.spoil = stays
    _, cause = thruster.play((8.0, 12.0, 0.0)) or (0.0, "")
    assert "N at rest, where it was 0 N before" in cause


def late(channel: str, seconds: float):
    kept: list[Look] = []

    def spoil(_time: float, look: Look) -> Look:
        kept.append(look)
        return look._replace(**{channel: getattr(kept[max(len(kept) - 1 - round(seconds / TICK), 0)], channel)})

    return spoil


@pytest.mark.parametrize(
    ("channel", "said"),
    [("thrust", "the thrust comes 0.5"), ("rate", "the rotation comes 0.5")],
    ids=["thrust", "rate"],
)
def test_rows_that_come_half_a_second_late_are_found_at_the_second_step(channel, said):
    thruster = Thruster(late(channel, 0.5))
    time, cause = thruster.play((8.0, 12.0, 16.0)) or (0.0, "")
    assert time <= 3.0 + 3.0 + 1.4
    assert said in cause


def test_rows_that_come_a_fifth_of_a_second_late_pass():
    assert Thruster(late("thrust", 0.2)).play(STAIRS) is None


def test_in_flowing_water_the_thrust_may_have_another_factor():
    """A zero of thrust per n|n| that depends on the speed of advance: rotation and current are judged, jumps too."""

    def flows(_time: float, look: Look) -> Look:
        return look._replace(thrust=look.thrust - 3.0 * abs(look.rate), flowing=True)

    assert Thruster(flows).play((8.0, 10.0, 16.0, -8.0)) is None
    assert Thruster(lambda t, look: flows(t, look)._replace(flowing=False)).play((8.0, 10.0, 16.0, -8.0)) is not None


def test_while_nothing_is_sent_nothing_is_judged():
    thruster = Thruster()
    assert thruster.hold(8.0, 2.0) is None
    assert thruster.hold(None, 3.0) is None
    assert thruster.hold(0.0, 2.0) is None


def test_what_was_learnt_is_told():
    thruster = Thruster(astern=0.6)
    assert thruster.check.told() == ""
    thruster.play(STAIRS)
    told = thruster.check.told()
    assert "at +V rotation 0.9999 +- " in told
    assert "at +V thrust per n|n| 0.4" in told
    assert "at -V thrust per n|n| 0.24" in told
    assert "current per n|n| 0.035" in told
    assert "thrust 0.00 s after rotation (of " in told or "thrust 0.02 s after rotation (of " in told
