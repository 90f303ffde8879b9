"""Import: every layout of the shipped maps in small."""

import numpy as np
import pytest

from rig.errors import ConfigError, RecordingError
from tests.rig.importing.small_imports import imported, values


def test_levels_without_header_become_holds(tmp_path):
    text = "-5,-4.8,-2305,-5,-55.2,0.9,-2296\n0,0,0,0,0,0,0\n5,5,2425.9,5,50.8,-1.7,2366\n"
    _, recording, found = imported(tmp_path, text, "tank_static_levels")
    assert values(found["command_voltage"]) == [-5, 0, 5]
    assert found["command_voltage"].time.tolist() == [0, 4, 8]
    assert found["thrust"].time.tolist() == [2, 6, 10]
    assert values(found["rotation_rate"]) == [round(-2305 / 60, 6), 0, round(2425.9 / 60, 6)]
    assert [(s.phase, s.command_voltage, s.t_start, s.t_end) for s in recording.steps] == [
        ("hold", -5, 0, 4),
        ("hold", 0, 4, 8),
        ("hold", 5, 8, 12),
    ]
    assert (recording.kind, recording.thruster) == ("bollard", "ROV thruster D=0.1151 m")


def six_axis(t, force, tach):
    return ",".join(map(str, [0, t, *[2.5] * 6, *[0.1] * 6, 0, force, 0, 0, 0.05, 0, tach]))


def test_six_axis_cell(tmp_path):
    text = "\n".join(six_axis(0.001 * k, -2.0 * k, 0.5 * k) for k in range(4))
    _, _, found = imported(tmp_path, text, "tank_six_axis")
    assert values(found["thrust"]) == [0, 2, 4, 6]
    assert found["thrust"].time[-1] == pytest.approx(0.003)
    assert found["rotation_rate"].value[2] == pytest.approx(49.9723 / (2 * np.pi))
    _, _, found = imported(tmp_path, text, "tank_two_state", direction=-1)
    assert found["rotation_rate"].value[2] == pytest.approx(-49.9723 / (2 * np.pi))


def test_vectrino(tmp_path):
    row = "  {:7.3f}  6 00100011  {}  -0.002  -0.0020  -0.0031  31 51 52 51  1.9 6.9 6.7 4.9  60 77 86 57\r\n"
    _, _, found = imported(tmp_path, row.format(0.2, 0.25) + row.format(0.24, -0.5), "nortek_vectrino")
    assert values(found["flow_speed"]) == [0.25, -0.5]
    assert found["flow_speed"].time.tolist() == pytest.approx([0, 0.04])
    assert values(found["correlation_x"]) == [60, 60]


SINE = """#Channel\tAI_CH0\tAI_CH1\tAI_CH2\tAI_CH3
#Sensor \tForce\tCurrent\tN/C\tVoltage\tLever_Arm_Ratio
#Scaling_Factor\t885.74\t4.878\t1.0\t23.533\t0.667
#Sample_Rate\tEvery 0.05s
29-Jun-2022 10:36:57.239\t<begin logging>
29-Jun-2022 10:36:57.265\t0.0\t0.0\t0.0\t0.0
29-Jun-2022 10:36:57.465\t0.02\t-0.01\t0.0\t1.0
29-Jun-2022 10:36:57.965\t0.03\t0.5\t0.0\t-2.0
29-Jun-2022 10:41:28.807\t<end logging>
"""


def test_scaling_factors_come_from_the_header(tmp_path):
    summary, recording, found = imported(tmp_path, SINE, "labview_voltage_sine")
    assert found["thrust"].value.tolist() == pytest.approx(np.array([0.02, 0.03]) * 885.74 * 0.667 * 4.4482216152605)
    assert found["motor_voltage"].value.tolist() == pytest.approx([23.533, -47.066])
    assert found["thrust"].time.tolist() == pytest.approx([0.2, 0.7])
    said = " ".join(summary.sentences)
    assert "force_scale = 885.74" in said
    assert "2022-06-29T10:36:57.265000, without a time zone" in said
    assert "force: the first 1 rows are exactly 0" in said
    assert recording.first_of("command_voltage") is None
    with pytest.raises(RecordingError, match="no line above the data starts with '#Scaling_Factor'"):
        imported(tmp_path, SINE.replace("#Scaling_Factor", "#Scale"), "labview_voltage_sine")
    with pytest.raises(RecordingError, match="field 2 of #Scaling_Factor is 'much'"):
        imported(tmp_path, SINE.replace("885.74", "much"), "labview_voltage_sine")


def test_a_rate_stands_for_a_time(tmp_path):
    text = "weight[g],pwm,vbat[V],rpm1,rpm2,rpm3,rpm4,v[V],i[A],p[W]\n" + "".join(
        f"{w},{p},3.9,60,60,120,0,3.8,0.2,0.7\n" for w, p in ((0, 0), (1, 65535), (100, 65535), (50, 0))
    )
    _, _, found = imported(tmp_path, text, "crazyflie_supply_sag")
    assert values(found["command_voltage"]) == [0, 4.2, 0]
    assert found["command_voltage"].time.tolist() == pytest.approx([0, 0.01, 0.03])
    assert values(found["thrust"]) == [0, 0.009807, 0.980665, 0.490332]
    assert values(found["rotation_rate"])[0] == 1


def test_effort_is_volts_only_if_somebody_says_so(tmp_path):
    text = "effort,thrust_N\n-1,-85.1\n0.5,20\n"
    summary, _, found = imported(tmp_path, text, "effort_static")
    assert values(found["command_voltage"]) == [-1, 0.5]
    assert any("1 V stands for full effort" in sentence for sentence in summary.sentences)
    _, _, found = imported(tmp_path, text, "effort_static", nominal_voltage=48)
    assert values(found["command_voltage"]) == [-48, 24]
    with pytest.raises(ConfigError, match="did you mean nominal_voltage"):
        imported(tmp_path, text, "effort_static", nominal_volts=48)


def test_unsigned_speed_takes_the_sign_of_the_command(tmp_path):
    text = "PWM (\u03bcs),RPM,Current (A),Voltage (V),Power (W),Force (Kg f),Force (N),Efficiency (g/W)\n"
    text += "1100,3600,28,18,508,-4.6,-45.0,9\n1500,0,0,18,0,0,0,0\n1900,3600,28,18,508,6,59.0,9\n"
    _, _, found = imported(tmp_path, text, "blue_robotics_static")
    assert values(found["command_voltage"]) == [-18, 0, 18]
    assert values(found["rotation_rate"]) == [-60, 0, 60]
    assert values(found["thrust"]) == [-45, 0, 59]


def test_vehicle_trials(tmp_path):
    text = (
        "t_s,rel_alt_m,throttle_pwm_us,roll_rad,pitch_rad\n5,-1.2,1500,0,0\n5.34,-1.1,1580,0.1,0\n5.7,-1.0,1580,0,0\n"
    )
    _, recording, found = imported(tmp_path, text, "rov_depth")
    assert recording.kind == "vehicle"
    assert values(found["depth"]) == [1.2, 1.1, 1.0]
    assert found["depth"].axis == "heave"
    assert values(found["command_voltage"]) == [0, 0.2]
    assert found["depth"].time.tolist() == pytest.approx([0, 0.34, 0.7])
    text = (
        "t_s,speed_m_s,port_cmd,stbd_cmd,heading_deg,surge_cmd\n0,0.2,0.3,-0.2,179,0.25\n0.1,0.2,0.3,-0.2,-179,0.25\n"
    )
    _, _, found = imported(tmp_path, text, "usv_lake")
    assert found["heading"].value.tolist() == pytest.approx(np.radians([179, 181]))
    assert (found["command_port"].thruster, found["command_starboard"].thruster) == ("port", "starboard")
    assert found["command_port"].value.size == 1
    _, recording, found = imported(tmp_path, "Thrust Command,Mean Force [N]\n1.0,20.3\n-1.0,-6.1\n", "usv_bollard")
    assert values(found["thrust"]) == [20.3, -6.1]


RCB = "\ufeffTime (s),ESC signal (µs),Servo 1 (µs),Torque (N·m),Thrust ({}),Voltage (V),Current (A)," + (
    "Motor Electrical Speed (RPM),App message,\n"
)


@pytest.mark.parametrize(("unit", "newton"), [("N", 1.0), ("gf", 0.00980665), ("kgf", 9.80665)])
def test_rcbenchmark_in_any_unit_and_with_empty_cells(tmp_path, unit, newton):
    text = RCB.format(unit) + "0.1,1000,,0,0,12.1,0.1,0,start,\n0.2,1500,,0.02,2,12,3,6000,,\n0.3,1500,,,2,12,3,6000,\n"
    summary, _, found = imported(tmp_path, text, "rcbenchmark", nominal_voltage=12)
    assert found["thrust"].value.tolist() == pytest.approx([0, 2 * newton, 2 * newton])
    assert values(found["command_voltage"]) == [0, 6]
    assert values(found["rotation_rate"]) == [0, 100, 100]
    assert np.isnan(found["torque"].value[2])
    assert "rotation_rate_optical" not in found
    assert any("no column for optical_rpm" in sentence for sentence in summary.sentences)
    assert summary.bad == 0
