from dataclasses import replace
from math import cos, radians

import numpy as np
import pytest

from identification.estimation.maximum_likelihood import Gaussian, independent
from identification.recording import Channel, Recording, Step
from identification.thruster.thrust_data import Unusable
from identification.vehicle.campaign import identify_vehicle
from identification.vehicle.efficiency import Installation, Thruster
from identification.vehicle.replay import Replay
from rig.report.page import html
from rig.vehicle.answer import HeldOut, VehicleAnswer
from rig.vehicle.report.page import vehicle_page
from sim_devices.vehicle import romeo, run_trials
from sim_devices.vehicle.campaign import sines, yaw_steady
from tests.rig.report_reading import open_fonts, read


@pytest.fixture(scope="module", autouse=True)
def fonts():
    open_fonts()


def recording_of(record):
    channels = tuple(
        Channel(c.name, c.stream, c.quantity, c.unit, c.time, c.value, c.noise_std, thruster=c.thruster, axis=c.axis)
        for c in record.channels
    )
    steps = tuple(Step(s.index, s.phase, s.command_voltage, s.t_start, s.t_end) for s in record.steps)
    return Recording(record.name, record.vehicle, channels, steps=steps, kind="vehicle")


@pytest.fixture(scope="module")
def answer():
    """Yaw of the simulated vehicle, whose thrusters stand at 45 degrees."""
    c, lever = cos(radians(45)), 0.6
    signs = {"T1": (1, 1), "T2": (-1, -1), "T3": (-1, 1), "T4": (1, -1)}
    thrusters = tuple(
        Thruster(name, np.array([0.4]), {"surge": c, "sway": c * side, "yaw": lever * turn})
        for name, (side, turn) in signs.items()
    )
    vehicle = Installation(thrusters, np.diag(np.full(4, 1e-6)))
    rng = np.random.default_rng(5)
    found = [recording_of(one) for one in run_trials(romeo(), [*yaw_steady(), *sines("yaw")], rng)]
    return VehicleAnswer("<Romeo>", (), vehicle, {}, identify_vehicle(found, vehicle), {}, notes=("A note & more.",))


def test_page_of_an_identified_axis(answer):
    page = vehicle_page(answer)
    text = html(page)
    found = read(text)
    assert "Drag and inertia were identified for yaw" in page.lead
    assert "<Romeo>" in found.text
    assert "<Romeo>" not in text
    assert "A note & more." in found.text
    titles = [part.title for part in page.sections[0].parts if part.kind == "picture"]
    assert titles == [
        "Drag in yaw",
        "Velocities that the fit leaves over in yaw",
        "Trial yaw-sine-1, simulated",
        "Trial yaw-sine-2, simulated",
        "Inertia in yaw",
    ]


def test_efficiencies_are_drawn_beside_what_the_tunnel_promises(answer):
    result = answer.fit.axes["yaw"]
    known = independent(result.drag.estimate, Gaussian(("eta_hull",), np.array([0.7]), np.array([[1e-4]])))
    told = replace(result, drag=replace(result.drag, estimate=known, etas=("eta_hull",)))
    page = vehicle_page(replace(answer, fit=replace(answer.fit, axes={"yaw": told})))
    assert "efficiencies: eta_hull = 0.700 ± 0.010" in page.lead
    pictures = {part.title: part.plot for part in page.sections[0].parts if part.kind == "picture"}
    assert "Hollow points are what the tunnel calibration alone promises." in pictures["Drag in yaw"].alt
    assert "eta_hull 0.7 " in pictures["Efficiencies"].alt


def test_held_out_runs_and_other_estimators(answer):
    result = answer.fit.axes["yaw"]
    t = np.arange(50.0)
    run = Replay("check", "position", t, np.sin(t), np.sin(t) + 0.01)
    kept = (HeldOut("check", "yaw", run, replace(run, simulated=0 * t)), HeldOut("other", "surge", run, None))
    rivals = {"yaw": (result.inertia, Unusable("yaw: annealing did not end"))}
    full = replace(answer, replays={"yaw": (run,)}, held_out=kept, comparators=rivals)
    page = vehicle_page(full)
    said = repr(page.sections)
    held = next(section for section in page.sections if section.title == "Held out")
    assert held.parts[0].rows[0][:3] == ("check", "yaw", "0.01")
    assert len(held.parts) == 3
    assert "annealing did not end" in said
    assert "Trials of yaw, simulated" in said


def test_axis_that_could_not_be_identified_says_why(answer):
    result = answer.fit.axes["yaw"]
    lost = replace(result, drag=Unusable("yaw: no runs"), inertia=Unusable("yaw: no trials"))
    page = vehicle_page(replace(answer, fit=replace(answer.fit, axes={"yaw": lost}, unused=("x",))))
    assert page.lead.startswith("No axis was identified completely; not all of yaw")
    found = read(html(page))
    assert "yaw: no trials" in found.text
    assert "Recording x was not used" in found.text
    assert "svg" not in found.tags
