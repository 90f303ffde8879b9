"""Probes are harmless: every question of every kind, put to every simulated device, moves nothing and sets nothing."""

from __future__ import annotations

import pytest

from drivers import KINDS
from drivers.modbus.recognising import DRIVING
from drivers.modbus.rtu import Read
from drivers.recognition.can_traffic import CanProbe
from drivers.recognition.serial_line import Rate, SerialProbe
from drivers.vesc.recognising import HOST, LAST_ID
from sim_devices.instruments.modbus.cell import ModbusCell
from sim_devices.instruments.modbus.keller import Keller, KellerOptions
from sim_devices.instruments.modbus.pzem import Pzem, PzemOptions
from sim_devices.instruments.modbus.registers import ModbusCellOptions
from sim_devices.instruments.pololu.maestro import Maestro, MaestroOptions
from sim_devices.instruments.pololu.smc import Measured as SmcMeasured
from sim_devices.instruments.pololu.smc import SmcG2, SmcG2Options
from sim_devices.instruments.roboteq.controller import Roboteq
from sim_devices.instruments.roboteq.options import Measured, RoboteqOptions
from sim_devices.instruments.scpi.supply import Measured as SupplyMeasured
from sim_devices.instruments.scpi.supply import ScpiSupply, ScpiSupplyOptions
from sim_devices.instruments.serial_lines.hbm_aed import HbmAed, HbmAedOptions
from sim_devices.instruments.serial_lines.loadstar import Loadstar, LoadstarOptions
from sim_devices.instruments.serial_lines.mantracourt import Mantracourt, MantracourtOptions
from sim_devices.instruments.serial_lines.mt_sics import MtSics
from sim_devices.instruments.serial_lines.mt_sics_options import MtSicsOptions
from sim_devices.instruments.serial_lines.sartorius import Sartorius, SartoriusOptions
from sim_devices.instruments.vesc.codec import Telemetry
from sim_devices.instruments.vesc.controller import Vesc, VescOptions
from sim_devices.wires.can_frame import CanFrame

PROBES = {name: kind.probe for name, kind in KINDS.items() if isinstance(kind.probe, SerialProbe)}
ASKING = {name: probe for name, probe in PROBES.items() if probe.ask is not None}


class DirectLine:
    """A probe's line to a simulated device in this process; time passes by a tenth of a second a question."""

    def __init__(self, device) -> None:
        self.rate, self.addresses, self.mute, self.withheld = Rate(9600), (1,), set(), []
        self.heard, self.heard_for, self.answers, self.requests = b"", 1.0, b"", []
        self._device, self.t = device, 10.0

    def ask(self, request, enough, timeout=0.3):
        self.t += 0.1
        self.requests.append(request)
        said = self._device.feed(request, self.t)
        self.answers += said
        return said


def roboteq(log, **options) -> Roboteq:
    return Roboteq(RoboteqOptions("roboteq", "p", **options), 48.0, Measured, log)


def maestro(said: list[str], **options) -> Maestro:
    made = Maestro(MaestroOptions("maestro", "p", **options), 16.0, lambda event, **_: said.append(event))
    made.feed(bytes((0x84, 0, 0x70, 0x2E)), 0.0)  # 1500 us: arms the ESC
    return made


def supply(log, **options) -> ScpiSupply:
    return ScpiSupply(ScpiSupplyOptions("scpi_supply", "p", **options), lambda: SupplyMeasured(3.0, 1.5), log)


DEVICES = {
    "mt_sics": lambda: MtSics(MtSicsOptions("mt_sics", "p"), lambda: 12.0),
    "keller": lambda: Keller(KellerOptions("keller", "p"), lambda: 1.1e5, lambda: 18.0),
    "modbus_cell": lambda: ModbusCell(ModbusCellOptions("modbus_cell", "p"), lambda: 12.0),
    "roboteq": lambda: roboteq(lambda *_, **__: None),
    "hbm_aed": lambda: HbmAed(HbmAedOptions("hbm_aed", "p"), lambda: 12.0),
    "loadstar": lambda: Loadstar(LoadstarOptions("loadstar", "p"), lambda: 12.0),
    "mantracourt_dsc": lambda: Mantracourt(MantracourtOptions("mantracourt", "p"), lambda: 12.0),
    "sartorius_sbi": lambda: Sartorius(SartoriusOptions("sartorius_sbi", "p"), lambda: 12.0),
    "pzem": lambda: Pzem(PzemOptions("pzem", "p"), lambda: 48.0, lambda: 1.5),
    "maestro": lambda: maestro([]),
    "smc_g2": lambda: SmcG2(SmcG2Options("smc_g2", "p"), 24.0, SmcMeasured, lambda *_, **__: None),
    "scpi_supply": lambda: supply(lambda *_, **__: None),
}


SAME_PLACES = {("modbus_cell", "keller"), ("modbus_cell", "pzem")}
"""Where the registers of the one lie where those of a cell do: it is asked for before, which the next test sees to."""
PAIRS = [(kind, device) for kind in ASKING for device in DEVICES if (kind, device) not in SAME_PLACES]


@pytest.mark.parametrize(("kind", "device"), PAIRS)
def test_a_kind_is_recognised_by_its_own_probe_and_by_no_other(kind, device):
    found = ASKING[kind].ask(DirectLine(DEVICES[device]()))
    assert (found.kind if found else None) == (kind if kind == device else None)


def test_keller_and_pzem_are_asked_for_before_the_cells_and_numbers_come_last():
    order = sorted(PROBES, key=lambda name: PROBES[name].order)
    assert order.index("keller") < order.index("modbus_cell") < order.index("line_stream")
    assert order.index("pzem") < order.index("modbus_cell")


@pytest.mark.parametrize("echo", [True, False])
def test_every_question_leaves_a_controller_as_it_was(echo):
    """It ran at 250 and its watchdog has stopped it: a `!` of any kind would let it go on."""
    said: list[str] = []
    device = roboteq(lambda event, **_: said.append(event), echo=echo)
    device.feed(b"!G 1 250\r", 0.0)
    device.tick(5.0)
    assert said == ["command", "timeout"]
    for probe in ASKING.values():
        line = DirectLine(device)
        probe.ask(line)
        device.drive(0.0, 0.001)
        assert line.requests
        assert device.power == 0.0
    assert said == ["command", "timeout"]
    device.feed(b"?FF\r", 20.0)  # a frame without an end of line was left in its buffer: this one is refused with it
    assert device.feed(b"~ECHOF\r~RWD\r", 20.0).count(b"ECHOF=" + (b"0" if echo else b"1")) == 1


def test_every_question_leaves_a_running_controller_running_and_feeds_no_watchdog():
    device = roboteq(lambda *_, **__: None)
    device.feed(b"!G 1 250\r", 9.95)
    for probe in ASKING.values():
        probe.ask(DirectLine(device))
        device.drive(0.0, 0.001)
    assert device.due == pytest.approx(10.95) or device.power == 0.0


def test_half_a_command_of_somebody_else_is_not_carried_out():
    """Whatever comes first must not end it."""
    for probe in ASKING.values():
        device = roboteq(lambda *_, **__: None)
        device.feed(b"!G 1 5", 0.0)
        found = probe.ask(DirectLine(device))
        device.drive(0.0, 0.001)
        assert device.power == 0.0
        if probe is ASKING["roboteq"]:
            assert found is not None


def test_no_question_is_an_end_of_line_alone_or_a_command():
    for probe in (each for each in ASKING.values() if not each.named_only):
        for device in DEVICES.values():
            line = DirectLine(device())
            probe.ask(line)
            assert all(request.strip() for request in line.requests)
            assert not any(request.startswith((b"!", b"^", b"@", b"%")) for request in line.requests)


@pytest.mark.parametrize("address", range(1, 248))
def test_no_question_at_any_address_drives_a_maestro(address):
    """Its packets begin with a byte above 7F, and what follows may be a set-point."""
    device = maestro([], on_error="go_to", home=1500.0)
    line = DirectLine(device)
    line.addresses = (address,)
    for probe in ASKING.values():
        probe.ask(line)
        line.t += 3.0
        device.tick(line.t)
        device.drive(0.0, 0.001)
        assert not DRIVING & set(b"".join(line.requests))
        assert device.pulse in (0.0, 1500.0)
    if address in DRIVING:
        assert "could drive a Pololu controller" in line.withheld[0]


@pytest.mark.parametrize("address", [1, 2, 64, 127, 131, 133, 134, 247])
def test_no_question_drives_a_simple_motor_controller(address):
    """It has left its safe-start, so that the next set-point would be obeyed."""
    device = SmcG2(SmcG2Options("smc_g2", "p"), 24.0, SmcMeasured, lambda *_, **__: None)
    device.feed(bytes((0x83, 0x85, 0, 0)), 0.0)
    line = DirectLine(device)
    line.addresses = (address,)
    for probe in ASKING.values():
        probe.ask(line)
        device.tick(line.t)
        device.drive(0.0, 0.001)
        assert device.speed == 0


def test_no_question_switches_a_supply_on_or_off():
    said: list[str] = []
    for probe in ASKING.values():
        for on in (False, True):
            device = supply(lambda event, **_: said.append(event), has_watchdog=False)
            device.feed(b"VOLT 3\nOUTP ON\n" if on else b"VOLT 3\n", 9.0)
            said.clear()
            probe.ask(DirectLine(device))
            assert (device.on, said) == (on, [])


def test_a_set_point_hidden_in_an_address_would_drive_one():
    """What the guard is there for: Modbus address 0x84 is Set Target of channel 3."""
    device = maestro([], channel=3, min_pulse=0.0)
    device.feed(Read(0x84, 3, 0x2E08, 2).encode()[:2] + bytes((0x2E, 0x2E)), 1.0)
    device.tick(2.0)
    assert device.pulse not in (0.0, 1500.0)


def test_a_ping_to_every_identifier_moves_no_vesc():
    said: list[str] = []
    vesc = Vesc(VescOptions("vesc"), 48.0, lambda: Telemetry(), lambda event, **_: said.append(event))
    probe = KINDS["vesc_can"].probe
    assert isinstance(probe, CanProbe)

    class Silence:
        frames, heard_for = (), 1.0

        def ask(self, requests, timeout=0.3):
            sent = [CanFrame(each.id, each.data) for each in requests]
            assert len(sent) == LAST_ID  # all but ours
            assert HOST not in [each.id & 0xFF for each in requests]
            from drivers.ports.can_frame import Frame

            return tuple(Frame(a.id, a.extended, a.data) for each in sent for a in vesc.receive(each, 1.0))

    (found,) = probe.ask(Silence())
    assert found.keys["vesc_id"] == 23
    assert said == []
