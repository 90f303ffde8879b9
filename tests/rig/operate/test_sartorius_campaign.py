"""The campaign of the other benches with a Sartorius balance in the place of the cell: only its table is another."""

import numpy as np
import pytest

from rig.cli import record_in_virtual_time
from rig.fit.answer import fit_recordings
from rig.hdf5.load import load
from sim_devices.instruments.serial_lines.sartorius import SartoriusOptions
from tests.rig.faulty_bench import Faulty
from tests.rig.operate.another_cell import RUN, TRUTH, files, world

CELL = """kind = "sartorius_sbi"
port = "ports/load_cell"
rate = 10.0
unit = "kg"
baud = 19200
resolution = 0.0098
gain_std = 0.0005
delay = 0.035
delay_std = 0.015
"""


def balance(**changed):
    return SartoriusOptions("sartorius_sbi", "load_cell", unit="kg", decimals=3, baud=19200, **changed)


def test_the_truth_of_the_world_is_found(tmp_path):
    path, _ = record_in_virtual_time(files(tmp_path, CELL), tmp_path / "run", world(balance()), RUN)
    recording = load(path)
    assert (recording.outcome, recording.cause) == ("completed", "")
    thrust = recording.first_of("thrust")
    assert np.mean(np.diff(thrust.time)) == pytest.approx(1 / 10, rel=0.02)
    (fitted,) = fit_recordings([recording])
    constant = fitted.fit.parameters["C"]
    assert constant.std < 0.002 * TRUTH
    assert abs(constant.value - TRUTH) < 2.0 * constant.std


@pytest.mark.parametrize(
    ("fault", "cause"),
    [
        ("overload", "load_cell.thrust"),
        ("error", "load_cell reports Err 54"),
        ("display_off", "load_cell reports OFF"),
        ("silent", "is stale"),
        ("frozen", "contradict"),
    ],
)
def test_a_fault_of_the_balance_ends_the_run(tmp_path, fault, cause):
    bench = Faulty(world(balance()), "load_cell", fault)
    with pytest.raises(RuntimeError, match=cause):
        record_in_virtual_time(files(tmp_path, CELL), tmp_path / "run", bench, RUN)
    assert bench.begun is not None
    zeros = [t for t, volts in bench.bench.commands if volts == 0.0 and t >= bench.begun]
    assert zeros[0] - bench.begun < 4.0, (
        "the balance says so ten times a second, and a wrong sign only at the next level"
    )
    assert bench.bench.commands[-1][1] == 0.0
