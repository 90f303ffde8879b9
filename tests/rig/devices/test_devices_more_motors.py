"""`rig devices` on the benches of ODrive, VESC by UART and the power meter: recognised, and nothing is commanded."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from drivers.odrive.recognising import hear
from drivers.ports.can_frame import Frame
from rig.cli import main
from sim_devices.bench.process import running

BENCHES = Path(__file__).parents[3] / "benches"


@pytest.mark.parametrize(
    ("which", "words", "said"),
    [
        ("odrive", ["--can", "slcan:{ports}/can0@500000"], "ODrive axis, CAN node 3"),
        ("vesc_uart", ["{ports}/motor", "--baud", "115200"], "vesc_uart\n  identity   VESC "),
        ("smc_g2", ["{ports}/motor", "--kind", "smc_g2"], "Pololu Simple Motor Controller, product"),
        ("maestro", ["{ports}/motor", "--kind", "maestro"], "Pololu Maestro, compact protocol"),
        ("scpi_supply", ["{ports}/motor", "--kind", "scpi_supply"], "output off, "),
        ("dronecan", ["--can", "slcan:{ports}/can0@1000000", "--seconds", "1.5"], "DroneCAN node 42, ESC 0"),
    ],
)
def test_a_motor_is_recognised_and_nothing_is_commanded(tmp_path, capsys, which, words, said):
    shutil.copy(BENCHES / which / "world.toml", tmp_path)
    with running(tmp_path / "world.toml", tmp_path / "ports") as bench:
        asked = [word.format(ports=bench.links) for word in words]
        assert main(["devices", "--seconds", "0.6", *asked]) == 0
        assert not any(each["volts"] for each in bench.truth("command"))  # a Maestro begins with neutral
    assert said in capsys.readouterr().out


class Heard:
    """Frames of a second."""

    heard_for = 1.0

    def __init__(self, *frames: Frame) -> None:
        self.frames = tuple((n, frame) for n, frame in enumerate(frames))


def test_an_emergency_of_canopen_is_no_axis():
    """Node 1's emergency has the identifier of a heartbeat of axis 4, and its TPDO 1 that of axis 12."""
    assert hear(Heard(*[Frame(0x081, False, bytes(8))] * 3)) == []
    assert hear(Heard(*[Frame(0x181, False, b"\x27\x06" + bytes(6))] * 50)) == []
    axis = [Frame(0x061, False, bytes((0, 0, 0, 0, 1, 0, 0, 0)))] * 10 + [Frame(0x069, False, bytes(8))] * 100
    (found,) = hear(Heard(*axis))
    assert found.keys == {
        "node_id": 3, "heartbeat_rate": 10.0, "rate": 100.0, "current_rate": 0.0, "supply_rate": 0.0,
        "thermal_rate": 0.0,
    }  # fmt: skip
    assert "sends nothing for current_rate, supply_rate" in found.settings[-1]
