"""Each export, read as its consumer's documented source reads it, loses what the file itself says it loses."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from math import pi
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import yaml

from tests.rig.exporting.twins.conftest import by_hand, module_of

VOLTS = np.linspace(-16.0, 16.0, 200)
WANTED = by_hand(VOLTS)
LAG = 0.0967


def rate(volts):
    return 1.9 * np.sign(volts) * np.maximum(np.abs(volts) - 0.9, 0.0)


def told(path: Path) -> float:
    """N rms, as the file says."""
    return float(re.search(r"200 commands: ([\d.e-]+) N rms", path.read_text())[1])


def rms(found) -> float:
    return float(np.sqrt(np.mean(np.square(np.asarray(found) - twin_at(VOLTS)))))


FOLLOWED = 1.000125
"""The water of this twin follows in 0.4 s by 15 % of the thrust: so much is left of that after three seconds."""


def twin_at(volts):
    return FOLLOWED * by_hand(volts)


def floats(text: str) -> np.ndarray:
    return np.array([float(x) for x in text.split()])


def same(path: Path, found) -> None:
    assert rms(found) == pytest.approx(told(path), rel=0.02, abs=2e-3)


def test_stonefish(exported):
    path = exported("stonefish", "--diameter", "0.0762")
    root = ElementTree.fromstring(f"<all>{path.read_text()}</all>")
    (actuator,) = root.findall("actuator")
    assert actuator.get("type") == "thruster"
    assert float(actuator.find("specs").get("max_setpoint")) == 16.0
    assert float(actuator.find("propeller").get("diameter")) == 0.0762
    dynamics, model = actuator.find("rotor_dynamics"), actuator.find("thrust_model")
    assert (dynamics.get("type"), model.get("type")) == ("first_order", "linear_interpolation")
    assert float(dynamics.find("time_constant").get("value")) == pytest.approx(LAG, rel=0.01)
    table = [floats(model.find(name).get("value")) for name in ("input", "output")]
    same(path, np.interp(VOLTS, *table))


def test_uuv_simulator(exported):
    path = exported("uuv")
    plugin = ElementTree.fromstring(f"<all>{path.read_text()}</all>").find("plugin")
    assert plugin.findtext("dynamics/type") == "FirstOrder"
    assert float(plugin.findtext("dynamics/timeConstant")) == pytest.approx(LAG, rel=0.01)
    assert plugin.findtext("conversion/type") == "LinearInterp"
    table = [floats(plugin.findtext(f"conversion/{name}")) for name in ("inputValues", "outputValues")]
    clamped = np.clip(VOLTS, float(plugin.findtext("clampMin")), float(plugin.findtext("clampMax")))
    least, most = float(plugin.findtext("thrustMin")), float(plugin.findtext("thrustMax"))
    found = np.clip(np.interp(clamped, *table), least, most)
    same(path, found * float(plugin.findtext("thrust_efficiency")))


@pytest.mark.parametrize("word", ["uuv-manager", "plankton-manager"])
def test_thruster_manager(exported, word):
    path = exported(word)
    content = yaml.safe_load(path.read_text())
    manager = (content["/**"]["ros__parameters"] if word[0] == "p" else content)["thruster_manager"]
    assert manager["conversion_fcn"] == "custom"
    table = manager["conversion_fcn_params"]
    assert all(isinstance(x, float) for x in (*table["input"], *table["output"]))
    assert np.all(np.diff(table["output"]) > 0)  # numpy.interp wants it so
    command = np.interp(WANTED, table["output"], table["input"])
    assert by_hand(command) == pytest.approx(WANTED, abs=0.1)
    assert manager["max_thrust"] == pytest.approx(-by_hand(np.array([-16.0]))[0], rel=1e-3)


def test_gz_sim(exported):
    path = exported("gz-sim-rate", "--diameter", "0.08")
    plugin = ElementTree.fromstring(f"<all>{path.read_text()}</all>").find("plugin")
    assert plugin.get("name") == "gz::sim::systems::Thruster"
    k, rho, d = (
        float(plugin.findtext(x)) for x in ("thrust_coefficient", "fluid_density", "propeller_diameter")
    )  # fmt: skip
    omega = 2 * pi * rate(VOLTS)
    same(path, k * rho * d**4 * omega * np.abs(omega))
    assert float(plugin.findtext("max_thrust_cmd")) == pytest.approx(omega.max(), rel=1e-6)
    newtons = ElementTree.fromstring(f"<all>{exported('gz-sim').read_text()}</all>").find("plugin")
    assert newtons.findtext("use_angvel_cmd") == "false"
    assert float(newtons.findtext("min_thrust_cmd")) == pytest.approx(WANTED.min(), rel=1e-3)


def test_auv_controllers(exported):
    path = exported("auv-polynomial", "--pulse", "1000", "1500", "2000")
    (controller,) = (each["ros__parameters"] for each in yaml.safe_load(path.read_text()).values())
    us = np.polynomial.polynomial.polyval(twin_at(VOLTS), controller["thrust_curve_coefficients"])
    us = np.where(twin_at(VOLTS) == 0.0, controller["neutral_pwm"], np.clip(us, 1000, 2000))
    same(path, twin_at(16.0 * (us - 1500) / 500))
    assert controller["min_deadband_pwm"] == pytest.approx(1475, abs=1)  # the point of the table within 0.9 V


def parameters(path: Path, split: str, name: int, value: int) -> dict[str, float]:
    rows = [line.split(split) for line in path.read_text().splitlines() if not line.startswith("#")]
    return {row[name]: float(row[value]) for row in rows}


def test_ardusub(exported):
    path = exported("ardusub")
    found = parameters(path, ",", 0, 1)
    e, start = found["MOT_THST_EXPO"], found["MOT_SPIN_MIN"]
    most = re.search(r"Full effort: ([\d.]+) N ahead, ([\d.]+) N astern", path.read_text())
    ahead, astern = float(most[1]), float(most[2])
    u = np.maximum(np.abs(VOLTS / 16.0) - start, 0.0) / (1 - start)
    same(path, np.where(VOLTS < 0, -astern, ahead) * ((1 - e) * u + e * u * u))
    assert found["SERVO1_TRIM"] == 1500
    assert "released firmware takes effort for thrust" in path.read_text()


def test_px4(exported):
    path = exported("px4")
    found = parameters(path, "\t", 2, 3)
    most = float(re.search(r"Full effort: ([\d.]+) N", path.read_text())[1])
    f, x = found["THR_MDL_FAC"], np.abs(VOLTS / 16.0)
    same(path, np.sign(VOLTS) * most * (f * x * x + (1 - f) * x))
    assert found["SIH_T_TAU"] == pytest.approx(LAG, rel=0.01)


def test_fossen(exported):
    class Otter:
        pass

    otter, path = Otter(), exported("pvs")
    exec(path.read_text(), {"self": otter})
    n = 2 * pi * rate(VOLTS)
    same(path, np.where(n < 0, otter.k_neg, otter.k_pos) * n * np.abs(n))
    matlab = dict(re.findall(r"^(\w+) = ([-\d.e+]+);", exported("mss").read_text(), re.M))
    assert {name: float(value) for name, value in matlab.items()} == pytest.approx(vars(otter))
    assert otter.T_n == pytest.approx(LAG, rel=0.01)


def test_holoocean(exported):
    path = exported("holoocean")
    module = module_of(path)
    same(path, [np.clip(module.steady(v), -28.75, 28.75) for v in VOLTS])
    one = module.Thruster()
    responses = [one(8.0, 0.01) for _ in range(100)]
    wanted = [module.steady(8.0 * (1 - np.exp(-(i + 1) * 0.01 / LAG))) for i in range(100)]
    assert responses == pytest.approx(wanted, abs=0.02)
    with pytest.warns(UserWarning, match="clips"):
        one(16.0, 10.0)
    said = subprocess.run([sys.executable, str(path)], capture_output=True, text=True, check=True).stdout
    assert said == "self-check passed\n"


def test_table(exported):
    path = exported("table")
    lines = [line for line in path.read_text().splitlines() if line[0] != "#"]
    rows = np.genfromtxt(lines, delimiter=",", skip_header=1)
    same(path, np.interp(VOLTS, rows[:, 0], rows[:, 1]))
    assert np.all(rows[:, 2] <= rows[:, 1])
    assert np.all(rows[:, 1] <= rows[:, 3])


compiler = shutil.which("cc")
MAIN = r"""
#include "t1.h"
#include <stdio.h>
int main(void) {
    int i;
    double x = 0;
    if (!T1_self_check()) return 1;
    for (i = 0; i < 200; ++i) printf("%.17g\n", T1_thrust(-16.0 + 32.0 * i / 199));
    for (i = 0; i < 1000; ++i) x = T1_lagging(x, 8.0, 0.001);
    printf("%.17g\n", x);
    return 0;
}
"""


@pytest.mark.skipif(compiler is None, reason="no C compiler on this machine")
def test_c_header(exported, tmp_path):
    path = exported("c-header").rename(tmp_path / "t1.h")
    (tmp_path / "main.c").write_text(MAIN)
    strict = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic"]
    subprocess.run([compiler, *strict, "-o", "t1", "main.c"], cwd=tmp_path, check=True)
    said = subprocess.run([tmp_path / "t1"], capture_output=True, text=True, check=True).stdout
    *found, lagging = [float(x) for x in said.split()]
    same(path, found)
    assert lagging == pytest.approx(8.0 * (1 - np.exp(-1.0 / LAG)), rel=0.01)


@pytest.mark.skipif(compiler is None, reason="no C compiler on this machine")
def test_fmu(exported, tmp_path):
    import fmpy
    from fmpy.validation import validate_fmu

    path = str(exported("fmu").rename(tmp_path / "t1.fmu"))
    assert validate_fmu(path) == []
    each = 1.0
    steps = np.array([(i * each, v) for i, v in enumerate(VOLTS)], dtype=[("time", "f8"), ("input", "f8")])
    at_once = {"time_constant": 0.0}
    found = fmpy.simulate_fmu(path, input=steps, stop_time=200.0, output_interval=each, start_values=at_once)
    thrust = np.interp(np.arange(200) * each + each, found["time"], found["thrust"])
    assert rms(thrust) < 0.04
    weaker = {"efficiency": 0.5}
    half = fmpy.simulate_fmu(path, input=steps[-1:], stop_time=0.5, output_interval=0.01, start_values=weaker)
    table = np.interp(16.0 * (1 - np.exp(-half["time"] / LAG)), VOLTS, twin_at(VOLTS))
    assert half["thrust"] == pytest.approx(0.5 * table, abs=0.2)
    description = fmpy.read_model_description(path)
    assert {v.name: v.unit for v in description.modelVariables if v.unit} == {
        "input": "V", "thrust": "N", "half_width": "N", "time_constant": "s",
    }  # fmt: skip
