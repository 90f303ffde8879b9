"""Expected energy: by hand for a cubic power, from a recording that was made, and not at all where it is not known."""

import numpy as np
import pytest

from identification.recording import Channel, Recording, Step
from rig.campaign.dwell import FixedDwell
from rig.campaign.loading import load_campaign
from rig.campaign.plan import Plan, TareConfig
from rig.campaign.shapes import Levels
from rig.dry_run.earlier import known_power
from rig.dry_run.outlook import energies_of, told_energies
from rig.dry_run.power import Energy, PowerCurve, energy, measured_power
from rig.hdf5 import load
from tests.rig.campaign_report.played_campaigns import files, played

IDLE, CUBIC = 5.0, 0.25
CURVE = PowerCurve((-12.0, -6.0, 0.0, 6.0, 12.0), tuple(IDLE + CUBIC * v**3 for v in (12, 6, 0, 6, 12)), "earlier.h5")


def test_energy_of_holds_and_ramps_is_that_of_the_integral():
    plan = Plan(Levels((8.0, -10.0)), FixedDwell(4.0), slew=2.0, rest=1.0, tare=TareConfig(duration=3.0))
    seconds = plan.duration().expected
    holds = CUBIC * 4.0 * (8.0**3 + 10.0**3)
    ramps = CUBIC * (2 * 8.0**4 + 2 * 10.0**4) / (4 * 2.0)  # 0 to 8, 8 to 0, 0 to -10, -10 to 0
    found = energy(tuple(plan), CURVE)
    assert isinstance(found, Energy)
    assert found.joules == pytest.approx(IDLE * seconds + holds + ramps, rel=1e-3)
    assert found.mean_watts == pytest.approx(found.joules / seconds)
    assert found.peak_watts == pytest.approx(IDLE + CUBIC * 1000.0)


@pytest.mark.parametrize("volts", [12.5, -14.0])
def test_power_beyond_what_was_measured_is_not_made_up(volts):
    found = energy(tuple(Plan(Levels((volts,)), FixedDwell(4.0), slew=2.0)), CURVE)
    assert isinstance(found, str)
    assert found.startswith("not known: the plan goes from")
    assert "earlier.h5 has the power from -12 to 12 V only" in found


def recording(
    *, current: str = "input_current", rows: int = 100, phases: tuple[str, ...] = ("tare", "hold")
) -> Recording:
    """10 s at rest with 0.1 A, 10 s at 8 V with 3 A, at 48 and 47 V of supply."""
    time = np.linspace(0.0, 20.0, rows)
    moving = time >= 10.0
    channels = (
        Channel("bus_voltage", "motor", "bus_voltage", "V", time, np.where(moving, 47.0, 48.0)),
        Channel(current, "motor", None, "A", time, np.where(moving, 3.0, 0.1)),
    )
    steps = tuple(Step(k, phase, 8.0 * k, 10.0 * k, 10.0 * (k + 1)) for k, phase in enumerate(phases))
    return Recording("id", "T1", channels, steps, source="T1.h5")


def test_power_is_that_of_the_supply_at_each_level():
    found = measured_power(recording())
    assert isinstance(found, PowerCurve)
    assert found.volts == (0.0, 8.0)
    assert found.watts == pytest.approx((4.8, 141.0))


@pytest.mark.parametrize(
    ("made", "why"),
    [
        (recording(current="current"), "T1.h5 has no input_current"),
        (recording(rows=4), "T1.h5 has no power measured at rest and at one level or more"),
        (recording(phases=("tare", "sine")), "T1.h5 has no power measured at rest and at one level or more"),
    ],
)
def test_a_recording_that_does_not_say_it_is_told(made, why):
    assert measured_power(made) == why


def test_the_sum_is_told_only_where_all_are_known():
    plan = tuple(Plan(Levels((8.0,)), FixedDwell(4.0), slew=2.0))
    both = energies_of(plan, {"T1": CURVE, "T2": CURVE})
    assert told_energies(both)[-1].startswith("all 2: ")
    lines = told_energies(energies_of(plan, {"T1": CURVE, "T2": "not known: no earlier recording"}))
    assert lines[1:] == ["T2: not known: no earlier recording"]


def test_of_a_played_campaign_the_expected_energy_is_what_the_recording_took(tmp_path):
    folder = played(tmp_path)
    campaign = load_campaign(files(tmp_path))
    name = campaign.thrusters[0]
    curve = known_power(tmp_path, name)
    assert isinstance(curve, PowerCurve), curve
    assert curve.source == f"{folder.name}/{name}.h5"
    found = energy(tuple(campaign.plan), curve)
    assert isinstance(found, Energy), found

    made = load(folder / f"{name}.h5")
    begin = next(step.t_start for step in made.steps if step.index == 0)
    end = made.steps[-1].t_end
    current = next(c for c in made.channels if c.name == "input_current")
    time, amperes = current.window(begin, end)
    supply = made.first_of("bus_voltage")
    assert supply is not None
    took = np.trapezoid(amperes * np.interp(time, supply.time, supply.value), time)
    assert found.joules == pytest.approx(took, rel=0.1)


def test_only_recordings_of_that_thruster_are_looked_at(tmp_path):
    folder = tmp_path / "earlier"
    folder.mkdir()
    for name in ("T10.h5", "T1-old.h5", "T1.txt"):
        (folder / name).write_bytes(b"no recording")
    nothing = "not known: no earlier recording of T1 in the output folder"
    assert known_power(tmp_path, "T1") == nothing
    assert known_power(tmp_path / "nowhere", "T1") == nothing
    (folder / "T1-2.h5").write_bytes(b"no recording")
    found = known_power(tmp_path, "T1")
    assert isinstance(found, str)
    assert "T1-2.h5" in found
