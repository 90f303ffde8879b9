"""The maps against real recordings that are not part of the project: skipped where they are not."""

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rig.diagnose.command import diagnose_files
from rig.errors import RecordingError
from rig.fit.answer import fit_files
from rig.hdf5 import load
from rig.importing.mapping import build_map, read_map
from rig.importing.one_file import import_file

REAL = Path(__file__).parents[3].parent / "shared" / "recordings"
LAYOUTS = {
    "rov_thruster_tank/Tach_RPM_Thrust_Data.csv": "tank_static_levels",
    "rov_thruster_tank/Fwd_Rvrs_Set*.csv": "tank_six_axis",
    "rov_thruster_tank/2state*.csv": "tank_two_state",
    "rov_thruster_tank/*.dat": "nortek_vectrino",
    "voltage_sine_stand/*.log": "labview_voltage_sine",
    "propeller_supply_sag/*.csv": "crazyflie_supply_sag",
    "m5_static/*.csv": "effort_static",
    "t200_18v_static/*.csv": "blue_robotics_static",
    "rov_depth/*.csv": "rov_depth",
    "usv_lake/14FEB*.csv": "usv_lake",
    "usv_lake/tcurve.csv": "usv_bollard",
}
pytestmark = pytest.mark.skipif(not REAL.is_dir(), reason=f"the real recordings are not at {REAL}")


@pytest.mark.parametrize(("pattern", "layout"), LAYOUTS.items())
def test_every_real_file_imports_whole(tmp_path, pattern, layout):
    sources = sorted(REAL.glob(pattern))
    assert sources, f"{pattern} finds nothing"
    for source in sources:
        out = tmp_path / f"{source.name}.h5"
        summary = import_file(source, read_map(layout), out)
        assert summary.bad == 0
        recording = load(out)
        begun = 1 if layout == "labview_voltage_sine" else 0  # its first row is before the first sample
        assert max(channel.value.size for channel in recording.channels) == summary.rows - begun
        assert recording.complete


def rmse(recording, voltage, *, tare, signs):
    thrust = recording.first_of("thrust")
    V = recording.first_of(voltage).held_at(thrust.time)
    good = np.isfinite(thrust.value) & np.isfinite(V)
    square, y = (V * np.abs(V))[good], thrust.value[good]
    columns = [square * (square > 0), square * (square < 0)] if signs else [square]
    H = np.column_stack([*columns, *([np.ones_like(square)] if tare else [])])
    theta, *_ = np.linalg.lstsq(H, y, rcond=None)
    return float(np.sqrt(np.mean((y - H @ theta) ** 2)))


@pytest.mark.parametrize(
    ("source", "layout", "voltage", "plain", "tared", "signed"),
    [
        (
            "voltage_sine_stand/sensors_fixed_calibrated_test2.log",
            "labview_voltage_sine",
            "motor_voltage",
            62.0,
            5.34,
            3.06,
        ),
        (
            "voltage_sine_stand/sensors_fixed_calibrated_test5.log",
            "labview_voltage_sine",
            "motor_voltage",
            59.0,
            5.31,
            2.93,
        ),
        (
            "voltage_sine_stand/sensors_fixed_calibrated_test6.log",
            "labview_voltage_sine",
            "motor_voltage",
            58.6,
            5.07,
            2.91,
        ),
        ("rov_thruster_tank/Tach_RPM_Thrust_Data.csv", "tank_static_levels", "command_voltage", 3.60, 3.51, 3.42),
        ("t200_18v_static/t200_18v_data.csv", "blue_robotics_static", "command_voltage", 3.70, 2.89, 2.00),
        ("m5_static/json_nez_prop.csv", "effort_static", "command_voltage", 12.7, 12.6, 12.5),
    ],
)
def test_known_misfits_are_reproduced(tmp_path, source, layout, voltage, plain, tared, signed):
    """RMSE in N of C V|V|, with a tare, with C+/C- and a tare, as computed independently from the raw columns."""
    out = tmp_path / "r.h5"
    import_file(REAL / source, read_map(layout), out)
    recording = load(out)
    assert rmse(recording, voltage, tare=False, signs=False) == pytest.approx(plain, rel=0.01)
    assert rmse(recording, voltage, tare=True, signs=False) == pytest.approx(tared, rel=0.01)
    assert rmse(recording, voltage, tare=True, signs=True) == pytest.approx(signed, rel=0.01)


TIMED = """about = "the tank's static levels with a time, as a person typed them in"
kind = "bollard"
thruster = "tank"
[time]
column = "t"
[streams.stand.channels.command_voltage]
quantity = "command_voltage"
unit = "V"
column = "U"
[streams.stand.channels.thrust]
quantity = "thrust"
unit = "N"
column = "F"
"""


def test_a_level_table_with_times_is_never_half_a_level_late(tmp_path):
    """Asked about; as a log (before) it fits with 9.6 N and `rig fit` says why; as levels (after) with 0.65 N."""
    rows = np.loadtxt(REAL / "rov_thruster_tank" / "Tach_RPM_Thrust_Data.csv", delimiter=",")
    lines = [f"{15 * k + 10},{row[0]},{row[4]}" for k, row in enumerate(rows)]
    (tmp_path / "levels.csv").write_text("\n".join(["t,U,F", *lines]))
    plan = build_map(tomllib.loads(TIMED), TIMED, "timed")
    with pytest.raises(RecordingError, match="levels = true or levels = false"):
        import_file(tmp_path / "levels.csv", plan, tmp_path / "asked.h5")
    fitted, warned = {}, {}
    for levels in (False, True):
        out = tmp_path / f"{levels}.h5"
        import_file(tmp_path / "levels.csv", replace(plan, time=replace(plan.time, levels=levels)), out)
        fitted[levels] = diagnose_files([out]).train.after
        warned[levels] = [note for note in fit_files([out])[0].notes if "leads its command by 7.5 s, 50 %" in note]
    assert fitted[True] < 1.0 < 5.0 < fitted[False]
    assert (len(warned[False]), len(warned[True])) == (1, 0)


@pytest.mark.parametrize(
    ("source", "layout"),
    [
        ("rov_thruster_tank/Tach_RPM_Thrust_Data.csv", "tank_static_levels"),
        ("m5_static/json_nez_prop.csv", "effort_static"),
        ("t200_18v_static/t200_18v_data.csv", "blue_robotics_static"),
    ],
)
def test_level_tables_do_not_need_changes(tmp_path, source, layout):
    plan = read_map(layout)
    without = replace(plan, streams={name: replace(stream, changes=None) for name, stream in plan.streams.items()})
    for name, one in (("with", plan), ("without", without)):
        import_file(REAL / source, one, tmp_path / f"{name}.h5")
    a, b = load(tmp_path / "with.h5"), load(tmp_path / "without.h5")
    assert a.steps == b.steps
    thrust = a.first_of("thrust")
    assert np.array_equal(thrust.time, b.first_of("thrust").time)
    assert np.array_equal(*(r.first_of("command_voltage").held_at(thrust.time) for r in (a, b)))
    assert all(s.t_start < t < s.t_end for s, t in zip(a.steps, thrust.time, strict=True))
