"""The campaign of the other benches with a Mantracourt card in the place of the cell: only its table is another."""

import numpy as np
import pytest

from rig.cli import record_in_virtual_time
from rig.fit.answer import fit_recordings
from rig.hdf5.load import load
from sim_devices.instruments.serial_lines.mantracourt import MantracourtOptions
from tests.rig.faulty_bench import Faulty
from tests.rig.operate.another_cell import RUN, TRUTH, files, world

CELL = """kind = "mantracourt_dsc"
port = "ports/load_cell"
rate = 50.0
unit = "kg"
resolution = 0.00981
gain_std = 0.0005
delay = 0.007
delay_std = 0.003
"""


def card(**changed):
    return MantracourtOptions("mantracourt_dsc", "load_cell", unit="kg", **changed)


def test_the_truth_of_the_world_is_found(tmp_path):
    path, _ = record_in_virtual_time(files(tmp_path, CELL), tmp_path / "run", world(card()), RUN)
    recording = load(path)
    assert (recording.outcome, recording.cause) == ("completed", "")
    thrust = recording.first_of("thrust")
    assert np.mean(np.diff(thrust.time)) == pytest.approx(1 / 50, rel=0.01)
    (fitted,) = fit_recordings([recording])
    constant = fitted.fit.parameters["C"]
    assert constant.std < 0.001 * TRUTH
    assert abs(constant.value - TRUTH) < 2.0 * constant.std


def test_a_slow_card_gives_each_value_once_and_the_preflight_says_so(tmp_path):
    with pytest.raises(RuntimeError, match=r"load_cell rate: 2\d(\.\d)?/s of 50/s: a run would be stopped for it"):
        record_in_virtual_time(files(tmp_path, CELL), tmp_path / "run", world(card(rate=20.0)), RUN)


@pytest.mark.parametrize(
    ("fault", "cause"),
    [
        ("overload", "load_cell.thrust"),
        ("integrity", "load cell integrity error"),
        ("shunt", "shunt calibration is on"),
        ("stopped", "is stale"),
        ("silent", "is stale"),
        ("refuses", "is stale"),
        ("frozen", "frozen"),
    ],
)
def test_a_fault_of_the_card_ends_the_run(tmp_path, fault, cause):
    bench = Faulty(world(card()), "load_cell", fault)
    with pytest.raises(RuntimeError, match=cause):
        record_in_virtual_time(files(tmp_path, CELL), tmp_path / "run", bench, RUN)
    assert bench.begun is not None
    zeros = [t for t, volts in bench.bench.commands if volts == 0.0 and t >= bench.begun]
    assert zeros[0] - bench.begun < 3.0
    assert bench.bench.commands[-1][1] == 0.0
