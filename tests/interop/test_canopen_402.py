"""CiA 402 with somebody else at the other end: our driver against a drive on `durand`, and the node of `canopen`
against our simulated drive."""

from __future__ import annotations

import time

import pytest

from drivers.canopen.cia402_options import Options
from drivers.errors import DeviceError, LinkError
from drivers.ports.can_bus import CanBus
from sim_devices.instruments.canopen.drive import Drive402
from sim_devices.instruments.canopen.drive_options import Cia402Options, Measured
from tests.interop.canopen_nodes import channel, dictionary, durand_node, simulated

pytestmark = pytest.mark.interop
OPTIONS = Options("bus", 5, max_voltage=24.0, watchdog_timeout=0.5, rate_per_volt=1.0, rated_current=20.0)


class DurandDrive:
    """What durand lacks of a CiA 402 drive: the objects, the state machine, the awaited heartbeat. The speed is what
    was set. Its words and tables are `canopen.profiles.p402`'s."""

    def __init__(self, node) -> None:
        from canopen.profiles.p402 import State402
        from durand import Record, Variable
        from durand.datatypes import DatatypeEnum

        self.node, self.od, self.tables = node, node.object_dictionary, State402
        self.state, self.heard, self.word = "SWITCH ON DISABLED", None, 0
        self.controlwords, self.targets = [], []
        od = self.od
        od[0x1000] = Variable(DatatypeEnum.UNSIGNED32, "ro", 0x00020192)
        od[0x1008] = Variable(DatatypeEnum.VISIBLE_STRING, "ro", b"durand drive")
        for index in (0x1016, 0x1029):
            od[index] = Record()
            od[index][1] = Variable(DatatypeEnum.UNSIGNED32 if index == 0x1016 else DatatypeEnum.UNSIGNED8, "rw", 0)
        forms = {
            "H": DatatypeEnum.UNSIGNED16,
            "I": DatatypeEnum.UNSIGNED32,
            "b": DatatypeEnum.INTEGER8,
            "h": DatatypeEnum.INTEGER16,
            "i": DatatypeEnum.INTEGER32,
        }
        written = {0x6007: "h", 0x605A: "h", 0x6040: "H", 0x6060: "b", 0x60FF: "i"}
        shown = {0x603F: "H", 0x6041: "H", 0x6061: "b", 0x606C: "i", 0x6075: "I", 0x6078: "h", 0x6079: "I"}
        values = {0x6075: 20_000, 0x6078: 250, 0x6079: 48_000, 0x6041: 0x0240}
        for index, form in (written | shown).items():
            od[index] = Variable(forms[form], "rw" if index in written else "ro", values.get(index, 0))
        od.download_callbacks[(0x6040, 0)].add(self._obey)
        od.download_callbacks[(0x6060, 0)].add(lambda mode: od.write(0x6061, 0, mode))
        od.download_callbacks[(0x60FF, 0)].add(self.targets.append)
        node.network.add_subscription(0x700 + 127, self._hear)

    def _hear(self, _cob_id, _data) -> None:
        self.heard = time.monotonic()

    def _obey(self, word) -> None:
        self.controlwords.append(word)
        commands = {
            0x06: "READY TO SWITCH ON",
            0x07: "SWITCHED ON",
            0x0F: "OPERATION ENABLED",
            0x00: "SWITCH ON DISABLED",
        }
        commands[0x02] = "QUICK STOP ACTIVE" if self.state == "OPERATION ENABLED" else "SWITCH ON DISABLED"
        wanted = "SWITCH ON DISABLED" if word & 0x80 and self.state == "FAULT" else commands.get(word)
        if (self.state, wanted) in self.tables.TRANSITIONTABLE:
            self.state = wanted

    def turn(self, _t) -> None:
        awaited = self.od.read(0x1016, 1) & 0xFFFF
        if self.heard is not None and awaited and time.monotonic() - self.heard > 1e-3 * awaited:
            self.heard, self.state = None, "QUICK STOP ACTIVE"
            self.node.emcy.set(0x8130, 0x11)
        elif self.state == "QUICK STOP ACTIVE":
            self.state = "SWITCH ON DISABLED"
        speed = self.od.read(0x60FF, 0) if self.state == "OPERATION ENABLED" else 0
        self.od.write(0x606C, 0, speed)
        self.od.write(0x6079, 0, 48_000)
        self.od.write(0x6041, 0, self.tables.SW_MASK[self.state][1] | 0x0200)


@pytest.fixture
def durand(third_party):
    third_party("durand")
    third_party("canopen")
    name, made = channel(), []

    def fill(node):
        made.append(DurandDrive(node))
        return made[0].turn

    with durand_node(name, 5, fill):
        bus = CanBus("virtual", name, 500_000)
        bus.open()
        yield bus, made[0]
        bus.close()


def hold(device, volts, seconds):
    rows = []
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        device.command(volts)
        time.sleep(0.02)
        rows += device.drain()
    return rows


def test_our_driver_on_a_durand_drive(durand):
    from drivers.canopen.cia402 import Cia402

    bus, drive = durand
    device = Cia402("motor", OPTIONS, bus)
    assert device.open() == "durand drive"
    assert set(drive.targets) <= {0}
    assert drive.state == "SWITCH ON DISABLED"
    read = {index: drive.od.read(index, 0) for index in (0x6007, 0x605A, 0x6061, 0x1017)}
    assert read == {0x6007: 3, 0x605A: 2, 0x6061: 3, 0x1017: 100}
    assert drive.od.read(0x1016, 1) == 127 << 16 | 500
    hold(device, 0.0, 0.4)
    assert drive.state == "SWITCHED ON"
    rows = hold(device, 10.0, 0.6)
    assert drive.state == "OPERATION ENABLED"
    assert drive.targets[-1] == 600
    newest = [row for row in rows if row.stream == "motor"][-1]
    assert newest.values == (10.0, 0x0227, 5.0)
    assert [row.values for row in rows if row.stream == "motor_state"][-1] == (3.0, 48.0)
    assert device.health().alive, device.health().error
    device.release()
    hold(device, 0.0, 0.2)
    assert 0x0002 in drive.controlwords
    assert drive.state in ("READY TO SWITCH ON", "SWITCHED ON")
    device.close()


def test_its_heartbeat_watch_stops_it_and_our_driver_waits_for_0(durand):
    from drivers.canopen.cia402 import Cia402

    bus, drive = durand
    device = Cia402("motor", OPTIONS, bus)
    device.open()
    hold(device, 0.0, 0.4)
    hold(device, 10.0, 0.4)
    end = time.monotonic() + 0.9
    while time.monotonic() < end:  # nothing is sent
        time.sleep(0.02)
        device.drain()
    assert drive.state == "SWITCH ON DISABLED"
    assert device.health().alive, device.health().error
    with pytest.raises(LinkError, match="command 0 V first"):
        device.command(10.0)
    hold(device, 0.0, 0.5)
    assert drive.state == "SWITCHED ON"
    device.close()


def test_an_emergency_of_a_durand_drive_ends_it(durand):
    from drivers.canopen.cia402 import Cia402

    bus, drive = durand
    device = Cia402("motor", OPTIONS, bus)
    device.open()
    hold(device, 0.0, 0.3)
    drive.node.emcy.set(0x2310, 0x03)
    hold(device, 0.0, 0.1)
    assert device.health().error.startswith("motor reports emergency 0x2310 (current), error register 0x03")
    device.close()


def test_a_node_that_is_no_drive_is_refused(third_party):
    third_party("durand")
    from durand import Variable
    from durand.datatypes import DatatypeEnum

    from drivers.canopen.cia402 import Cia402

    def fill(node):
        node.object_dictionary[0x1000] = Variable(DatatypeEnum.UNSIGNED32, "ro", 0x00080191)
        return lambda _t: None

    name = channel()
    with durand_node(name, 5, fill):
        bus = CanBus("virtual", name, 500_000)
        bus.open()
        with pytest.raises(DeviceError, match=r"node 5 is a device of CiA 401 .* expected CiA 402"):
            Cia402("motor", OPTIONS, bus).open()
        bus.close()


# -- the client of `canopen` on our simulated drive --------------------------------------------------------------------


@pytest.fixture
def client(third_party):
    """BaseNode402 of `canopen`, its network, and our drive, whose rotor follows at once."""
    canopen = third_party("canopen")
    from canopen.profiles.p402 import BaseNode402

    now = [Measured(0.0, 0.0, 48.0)]
    said = []
    options = Cia402Options("cia402", acceleration=10_000_000)
    drive = Drive402(options, 48.0, lambda: 1.0, lambda: now[0], lambda event, **more: said.append((event, more)))

    def world(dt):
        volts, _ = drive.drive(now[0].rotation_rate, max(dt, 1e-4))
        now[0] = Measured(0.0 if volts is None else drive.speed, 5.0, 48.0)

    name = channel()
    with simulated(name, drive, world):
        network = canopen.Network()
        network.NOTIFIER_SHUTDOWN_TIMEOUT = 5.0
        network.connect(name, interface="virtual")
        node = BaseNode402(5, dictionary(drive.node.objects))
        network.add_node(node)
        yield network, node, drive, said
        network.disconnect()


def test_canopen_drives_our_drive_through_its_state_machine(client):
    _, node, drive, _ = client
    assert node.sdo[0x1000].raw == 0x00020192
    assert node.sdo[0x1008].raw == "SIM402 servo drive"
    node.nmt.state = "PRE-OPERATIONAL"
    node.sdo[0x1017].raw = 50
    node.nmt.wait_for_heartbeat(2.0)
    node.tpdo.read()
    node.rpdo.read()
    tpdo = node.tpdo[2]
    tpdo.clear()
    for index in (0x6041, 0x6061, 0x606C):
        tpdo.add_variable(index)
    tpdo.trans_type, tpdo.event_timer, tpdo.enabled = 255, 20, True
    tpdo.save()
    node.nmt.state = "OPERATIONAL"
    node.setup_402_state_machine()
    node.op_mode = "PROFILED VELOCITY"
    node.state = "OPERATION ENABLED"
    assert drive.state == "enabled"
    node.sdo[0x60FF].raw = 600
    time.sleep(0.2)
    assert node.tpdo_values[0x606C] == 600
    node.state = "QUICK STOP ACTIVE"
    assert drive.state in ("quick stop", "switch on disabled")


def test_canopen_reads_aborts_and_the_heartbeat_watch_of_our_drive(client):
    network, node, drive, said = client
    from canopen import SdoAbortedError

    for place, value, code in (
        ((0x6041, 0), b"\0\0", 0x06010002),
        ((0x6007, 0), b"\7\0", 0x06090030),
        ((0x6007, 0), b"\0\0\0\0", 0x06070010),
    ):
        with pytest.raises(SdoAbortedError) as raised:
            node.sdo.download(*place, value)
        assert raised.value.code == code
    for place, code in (((0x5FFF, 0), 0x06020000), ((0x1018, 9), 0x06090011)):
        with pytest.raises(SdoAbortedError) as raised:
            node.sdo.upload(*place)
        assert raised.value.code == code
    node.sdo[0x1016][1].raw = 127 << 16 | 300
    node.sdo[0x6007].raw = 1
    network.send_message(0x700 + 127, [0x05])
    error = node.emcy.wait(0x8130, 2.0)
    assert (error.code, error.register) == (0x8130, 0x11)
    assert drive.state == "fault"
    (after,) = [more["after"] for event, more in said if event == "timeout"]
    assert after == pytest.approx(0.3, abs=0.05)
    assert node.is_faulted()
    node.reset_from_fault()
    assert drive.state == "enabled"
