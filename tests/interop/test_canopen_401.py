"""CiA 401 with somebody else at the other end: our driver against an output on `durand`, the client of `canopen`
against our simulated module."""

from __future__ import annotations

import time

import pytest

from drivers.canopen.cia401_options import Options
from drivers.ports.can_bus import CanBus
from sim_devices.instruments.canopen.output import Cia401Options, Output401
from tests.interop.canopen_nodes import channel, dictionary, durand_node, simulated

pytestmark = pytest.mark.interop


class DurandOutput:
    """Objects of CiA 401 on a durand node, and what durand lacks: the awaited heartbeat."""

    def __init__(self, node) -> None:
        from durand import Record, Variable
        from durand.datatypes import DatatypeEnum

        self.node, self.od, self.heard = node, node.object_dictionary, None
        od = self.od
        od[0x1000] = Variable(DatatypeEnum.UNSIGNED32, "ro", 0x00080191)
        od[0x1008] = Variable(DatatypeEnum.VISIBLE_STRING, "ro", b"durand output")
        forms = {
            0x1016: "UNSIGNED32",
            0x1029: "UNSIGNED8",
            0x6411: "INTEGER16",
            0x6443: "UNSIGNED8",
            0x6444: "INTEGER32",
        }
        for index, form in forms.items():
            od[index] = Record()
            od[index][1] = Variable(DatatypeEnum[form], "rw", 0)
        node.network.add_subscription(0x700 + 127, self._hear)

    def _hear(self, _cob_id, _data) -> None:
        self.heard = time.monotonic()

    def turn(self, _t) -> None:
        from durand.services.nmt import StateEnum

        awaited = self.od.read(0x1016, 1) & 0xFFFF
        if self.heard is not None and awaited and time.monotonic() - self.heard > 1e-3 * awaited:
            self.heard = None
            self.node.emcy.set(0x8130, 0x11)
            if self.od.read(0x1029, 1) == 2:
                self.node.nmt.set_state(StateEnum.STOPPED)

    @property
    def counts(self) -> int:
        stopped = int(self.node.nmt.state) == 4
        return self.od.read(0x6444 if stopped and self.od.read(0x6443, 1) else 0x6411, 1)


def hold(device, volts, seconds):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        device.command(volts)
        time.sleep(0.02)
        device.drain()


def test_our_driver_on_a_durand_output(third_party):
    third_party("durand")
    third_party("canopen")
    from drivers.canopen.cia401 import Cia401

    name, made = channel(), []

    def fill(node):
        made.append(DurandOutput(node))
        return made[0].turn

    with durand_node(name, 7, fill):
        bus = CanBus("virtual", name, 500_000)
        bus.open()
        device, output = Cia401("motor", Options("bus", 7, watchdog_timeout=0.5), bus), made[0]
        assert device.open() == "durand output"
        assert [output.od.read(index, 1) for index in (0x1029, 0x6411, 0x6443, 0x6444)] == [2, 0, 1, 0]
        hold(device, 0.0, 0.3)
        hold(device, -5.0, 0.3)
        assert output.counts == round(-5.0 * 3276.7)
        end = time.monotonic() + 0.9
        while time.monotonic() < end:  # nothing is sent
            time.sleep(0.02)
            device.drain()
        assert output.counts == 0
        hold(device, 0.0, 0.5)
        assert output.od.read(0x6411, 1) == 0
        hold(device, 5.0, 0.2)
        assert output.counts == 16384
        assert device.health().alive, device.health().error
        device.release()
        time.sleep(0.1)
        assert output.counts == 0
        device.close()
        bus.close()


def test_canopen_on_our_module(third_party):
    canopen = third_party("canopen")
    said = []
    module = Output401(Cia401Options("cia401"), 48.0, lambda event, **more: said.append((event, more)))
    name = channel()
    with simulated(name, module):
        network = canopen.Network()
        network.connect(name, interface="virtual")
        node = canopen.RemoteNode(7, dictionary(module.node.objects))
        network.add_node(node)
        try:
            assert node.sdo[0x1000].raw & 0xFFFF == 401
            node.rpdo.read()
            assert [each.index for each in node.rpdo[2]] == [0x6411] * 4
            node.nmt.state = "OPERATIONAL"
            time.sleep(0.05)
            node.rpdo[2][0].raw = 16384
            node.rpdo[2].transmit()
            time.sleep(0.1)
            assert module.output == pytest.approx(5.0, abs=1e-3)
            node.nmt.state = "STOPPED"
            time.sleep(0.1)
            assert module.output == pytest.approx(5.0, abs=1e-3), "as delivered it keeps the last voltage"
            node.nmt.state = "PRE-OPERATIONAL"
            time.sleep(0.05)
            node.sdo[0x6443][1].raw = 1
            node.sdo[0x1029][1].raw = 2
            node.sdo[0x1016][1].raw = 127 << 16 | 200
            node.nmt.state = "OPERATIONAL"
            network.send_message(0x700 + 127, [0x05])
            assert node.emcy.wait(0x8130, 2.0).code == 0x8130
            assert module.output == 0.0
            (after,) = [more["after"] for event, more in said if event == "timeout"]
            assert after == pytest.approx(0.2, abs=0.05)
        finally:
            network.disconnect()
