"""CiA 404 with somebody else at the other end: our driver against a cell on `durand`, the client of `canopen` against
our simulated cell."""

from __future__ import annotations

import time

import pytest

from drivers.canopen.cia404_options import Options
from drivers.ports.can_bus import CanBus
from sim_devices.instruments.canopen.cell import Cell404, Cia404Options
from tests.interop.canopen_nodes import channel, dictionary, durand_node, simulated

pytestmark = pytest.mark.interop


def fill_cell(node):
    """Objects of CiA 404 on a durand node; a force that rises by 1 N/s."""
    from durand import Record, Variable
    from durand.datatypes import DatatypeEnum

    od = node.object_dictionary
    od[0x1000] = Variable(DatatypeEnum.UNSIGNED32, "ro", 0x00020194)
    od[0x1008] = Variable(DatatypeEnum.VISIBLE_STRING, "ro", b"durand cell")
    forms = {0x6130: "REAL32", 0x9130: "INTEGER32", 0x6131: "UNSIGNED32", 0x6132: "UNSIGNED8", 0x6150: "UNSIGNED8"}
    for index, form in forms.items():
        od[index] = Record()
        od[index][1] = Variable(DatatypeEnum[form], "ro", {0x6131: 0x00210000, 0x6132: 2}.get(index, 0))

    def turn(t):
        od.write(0x6130, 1, t)
        od.write(0x9130, 1, round(100 * t))

    return turn


@pytest.mark.parametrize("keys", [{}, {"value": "int32"}, {"sync": True}], ids=["float", "int32", "SYNC"])
def test_our_driver_on_a_durand_cell(third_party, keys):
    third_party("durand")
    third_party("canopen")
    from drivers.canopen.cia404 import Cia404

    name = channel()
    with durand_node(name, 6, fill_cell):
        bus = CanBus("virtual", name, 500_000)
        bus.open()
        cell = Cia404("cell", Options("bus", 6, rate=50.0, **keys), bus)
        assert cell.open() == "durand cell"
        rows = []
        end = time.monotonic() + 0.6
        while time.monotonic() < end:
            time.sleep(0.02)
            rows += cell.drain()
        assert cell.health().alive, cell.health().error
        bus.close()
    assert len(rows) >= 10
    first, last = rows[0], rows[-1]
    slope = (last.values[0] - first.values[0]) / ((last.t_ns - first.t_ns) * 1e-9)
    assert slope == pytest.approx(1.0, abs=0.2)
    assert {row.values[1] for row in rows} == {0.0}


def test_canopen_on_our_cell(third_party):
    canopen = third_party("canopen")
    name, cell = channel(), Cell404(Cia404Options("cia404", decimals=3), lambda: 12.345)
    with simulated(name, cell):
        network = canopen.Network()
        network.connect(name, interface="virtual")
        node = canopen.RemoteNode(6, dictionary(cell.node.objects))
        network.add_node(node)
        try:
            assert node.sdo[0x1000].raw & 0xFFFF == 404
            assert node.sdo[0x6130][1].raw == pytest.approx(12.345, abs=1e-6)
            assert (node.sdo[0x9130][1].raw, node.sdo[0x6132][1].raw) == (12345, 3)
            assert node.sdo[0x6131][1].raw == 0x00210000
            with pytest.raises(canopen.SdoAbortedError) as raised:
                node.sdo[0x6130][1].raw = 0.0
            assert raised.value.code == 0x06010002
            node.tpdo.read()
            tpdo = node.tpdo[1]
            tpdo.clear()
            tpdo.add_variable(0x9130, 1)
            tpdo.add_variable(0x6150, 1)
            tpdo.trans_type, tpdo.enabled = 1, True
            tpdo.save()
            node.nmt.state = "OPERATIONAL"
            time.sleep(0.05)
            for _ in range(20):
                network.sync.transmit()
                assert tpdo.wait_for_reception(1.0) is not None
            assert [each.raw for each in tpdo] == [12345, 0]
            node.sdo[0x6125][1].raw = int.from_bytes(b"zero", "little")
            assert node.sdo[0x9130][1].raw == 0
        finally:
            network.disconnect()
