"""Promise 12 over real bytes, in virtual time: a button's contact at a digital, an analogue, a Modbus, a CAN input."""

from dataclasses import replace

import pytest

from rig.cli import record_in_virtual_time
from rig.hdf5.load import load
from sim_devices.bench.settings import load as load_world
from sim_devices.bench.virtual import VirtualBench
from sim_devices.bench.virtual_wire import Host
from sim_devices.instruments.button import ButtonOptions
from sim_devices.instruments.can_signals import CanSignalsOptions
from sim_devices.instruments.modbus.registers_device import RegistersOptions
from tests.rig.stages.lies.lying_bench import ROOT, files

RATE = 50.0
"""lines/s of the button."""
TICK = 0.02
"""s"""
BENCH = """
[devices.button]
kind = "line_stream"
port = "ports/button"
pattern = '(?P<value>[-+.\\d]+)'
quantity = "emergency_stop"
unit = "1"
rate = 50.0
line_characters = {characters}
scale = -1.0
{further}
"""
DIGITAL = (ButtonOptions("button", "button", rate=RATE), BENCH.format(characters=3, further="offset = 1.0"))
ANALOGUE = (
    ButtonOptions("button", "button", rate=RATE, closed=24.0, noise=0.1),
    BENCH.format(characters=8, further="threshold = -12.0"),
)

INPUTS = """
title = "Digital inputs"
source = "made up for this test"
function = 3
[channels.emergency_stop]
register = 0
type = "u16"
bit = 0
invert = true
unit = "1"
quantity = "emergency_stop"
"""
MODBUS = (
    RegistersOptions("modbus_registers", "button", ("0 u16 contact 1",), baud=115200),
    """
[devices.button]
kind = "modbus_registers"
port = "ports/button"
map = "inputs.toml"
baud = 115200
rate = 50.0
""",
)

SIGNALS = """
title = "Safety controller"
source = "made up for this test"
dbc = "safety.dbc"
[rates]
SAFETY = 50.0
[channels.emergency_stop]
signal = "SAFETY.contact"
unit = "1"
quantity = "emergency_stop"
scale = -1.0
offset = 1.0
"""
DBC = """VERSION ""

NS_ :

BS_:

BU_: A

BO_ 256 SAFETY: 8 A
 SG_ contact : 16|8@1+ (1,0) [0|1] "" A
"""
CAN = (
    CanSignalsOptions("can_signals", ("2 u8 contact 1",), rate=RATE),
    """
[devices.button]
kind = "can_signals"
bus = "bus0"
map = "safety.toml"
""",
)


class Pressed:
    """A bench whose button is pressed so many s into the first hold of `volts`, and pulled out 0.3 s later."""

    def __init__(self, bench: VirtualBench, fault: str, volts: float, after: float) -> None:
        self.bench, self.wires, self._fault, self._volts, self._after = bench, bench.wires, fault, volts, after
        self.at: float | None = None
        self.released = False

    def now_ns(self) -> int:
        return self.bench.now_ns()

    def sleep_until_ns(self, t_ns: int) -> None:
        self.bench.sleep_until_ns(t_ns)
        now = self.bench.now()
        if self.at is None and self.bench.commands:
            since, volts = self.bench.commands[-1]
            if abs(volts - self._volts) < 0.01 and now - since >= self._after:
                self.at = now
                self.bench.fault("button", self._fault)
        elif self.at is not None and not self.released and now > self.at + 0.3:
            self.released = True
            self.bench.clear("button")


def pressed(folder, wiring, fault="pressed", after=1.0):
    """(recording, s from the button to 0 V at the drive, commands after that)"""
    button, table = wiring
    settings = load_world(ROOT / "benches" / "simulated" / "world.toml")
    devices = {**settings.devices, "button": button}
    made = replace(settings, world=replace(settings.world, mounted="T2"), devices=devices, seed=4, step=0.005)
    host = Host(adapter=3e-4, work=5e-4, reader_late=2e-4, loop_late=3e-4)
    world = Pressed(VirtualBench(made, host, "bus0"), fault, 12.0, after)
    campaign = files(folder, 3.5)
    for name, text in (("inputs.toml", INPUTS), ("safety.toml", SIGNALS), ("safety.dbc", DBC)):
        (folder / name).write_text(text, encoding="utf-8")
    with (folder / "bench.toml").open("a", encoding="utf-8") as bench:
        bench.write(table)
    with pytest.raises(RuntimeError, match="the run ended tripped"):
        record_in_virtual_time(campaign, folder / "run", world, ("some-id", "2026-01-01"))
    assert world.at is not None
    later = [(t, volts) for t, volts in world.bench.commands if t >= world.at]
    return load(folder / "run" / "T2.h5"), later[0][0] - world.at, [volts for _, volts in later]


@pytest.mark.parametrize("wiring", [DIGITAL, ANALOGUE, MODBUS, CAN], ids=["digital", "analogue", "modbus", "can"])
@pytest.mark.parametrize("after", [0.31, 1.003, 1.507, 2.211])
def test_the_button_is_zero_volts_at_once_and_the_run_is_marked(tmp_path, report, wiring, after):
    recording, latency, later = pressed(tmp_path, wiring, after=after)
    assert (recording.outcome, recording.complete) == ("tripped", True)
    assert recording.cause.startswith("EMERGENCY STOP: button.emergency_stop is 1")
    assert set(later) == {0.0}, "latched: it was pulled out 0.3 s later, and nothing was driven again"
    report("emergency stop to 0 V", latency, "s")
    assert latency < 1 / RATE + 2 * TICK
    channel = recording.first_of("emergency_stop")
    assert set(channel.value) == {0.0, 1.0}, "a contact, whatever volts the input has"
    assert any("EMERGENCY STOP" in event.text for event in recording.events)


@pytest.mark.parametrize("wiring", [DIGITAL, MODBUS, CAN], ids=["digital", "modbus", "can"])
def test_a_wire_that_is_cut_is_a_pressed_button(tmp_path, report, wiring):
    recording, latency, later = pressed(tmp_path, wiring, fault="silent")
    assert "button.emergency_stop is stale" in recording.cause
    assert set(later) == {0.0}
    report("emergency stop falls silent, to 0 V", latency, "s")
    assert latency < 0.2 + 2 * TICK
