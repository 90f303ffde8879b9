"""Load-cell transmitters on Modbus: our driver against other people's server, other people's clients against ours.

And the two of ours with a pty between, which share nothing but the bytes.
"""

from __future__ import annotations

import asyncio
import os
import select
import struct
import threading
import tty

import pytest

from drivers.errors import DeviceError
from drivers.modbus.cell import ModbusCell
from drivers.modbus.cell_options import Options
from drivers.modbus.registers import ModbusRegisters
from drivers.modbus.registers import Options as RegistersOptions
from sim_devices.bench.process import running
from tests.drivers.collecting import collect
from tests.drivers.scripted_peer import wait_until

pytestmark = pytest.mark.interop
G = 9.80665
WORLD = """
mounted = "T1"
[thrusters]
T1 = {{ C = 0.4 }}
[cell]
zero_offset = {force}
[can]
adapters = []
[devices.cell]
kind = "modbus_cell"
port = "cell"
baud = 115200
map = "{map}"
{more}
"""


class Server:
    """pymodbus's own serial server at one end of a pty; `port` is the other."""

    def __init__(self, registers, kind):
        self.registers, self.kind = registers, kind
        self._stop, self._ready = threading.Event(), threading.Event()

    def __enter__(self):
        self._ours, ours = os.openpty()
        self._theirs, self._slave = os.openpty()
        for descriptor in (self._ours, ours, self._theirs, self._slave):
            tty.setraw(descriptor)
        self.port, self._rest = os.ttyname(ours), ours
        pumps = [(self._ours, self._theirs), (self._theirs, self._ours)]
        self._threads = [threading.Thread(target=self._pump, args=pair) for pair in pumps]
        self._threads.append(threading.Thread(target=asyncio.run, args=(self._serve(),)))
        for thread in self._threads:
            thread.start()
        assert self._ready.wait(10.0)
        return self

    def __exit__(self, *_):
        self._stop.set()
        for thread in self._threads:
            thread.join()
        for descriptor in (self._ours, self._rest, self._theirs, self._slave):
            os.close(descriptor)

    def _pump(self, source, sink):
        while not self._stop.is_set():
            if select.select([source], [], [], 0.01)[0]:
                os.write(sink, os.read(source, 4096))

    async def _serve(self):
        from pymodbus.datastore import ModbusDeviceContext, ModbusSequentialDataBlock, ModbusServerContext
        from pymodbus.server import ModbusSerialServer

        block = ModbusSequentialDataBlock(1, self.registers)
        context = ModbusServerContext(devices={1: ModbusDeviceContext(**{self.kind: block})}, single=False)
        server = ModbusSerialServer(context, port=os.ttyname(self._slave), baudrate=115_200)
        await server.serve_forever(background=True)
        self._ready.set()
        while not self._stop.is_set():
            await asyncio.sleep(0.01)
        await server.shutdown()


def told(port, kind, **more):
    scale = {} if kind == "seneca_z_sg" else {"unit": "kg", "decimals": 3}
    return Options(port, kind, **({"rate": 40.0, "baud": 115_200, "timeout": 1.0} | scale | more))


def of_seneca(value):
    registers = [0] * 100
    registers[63:65] = struct.unpack(">HH", struct.pack(">f", value))
    registers[77] = 0x10
    return registers


@pytest.mark.parametrize(
    ("kind", "block", "registers", "row"),
    [
        ("laumas", "hr", [0] * 6 + [0x0880, 0, 12345, 0, 12000, 0, 0, 3], (-12.345 * G, 1.0, 2176.0, -12345.0)),
        ("dini_argeo_dgt", "ir", [1, 0, 0, 7, 0b100, 0], (65.536 * G, 1.0, 4.0, 65536.0)),
        ("seneca_z_sg", "hr", of_seneca(-3.75), (-3.75 * G, 1.0, 16.0)),
    ],
)
def test_our_driver_against_the_server_of_pymodbus(kind, block, registers, row, third_party):
    third_party("pymodbus.server")
    with Server(registers, block) as server:
        cell = ModbusCell("cell", told(server.port, kind))
        cell.open()
        assert collect(cell, 5)[-1].values == pytest.approx(row)
        assert (cell.health().bad, cell.health().alive) == (0, True)
        cell.close()
        strange = ModbusCell("cell", told(server.port, "dini_argeo_dgt" if block == "hr" else "laumas"))
        with pytest.raises(DeviceError, match=r"exception 2 \(no such register\)|converter|overloaded|no weight"):
            strange.open()
        strange.close()


def bench(tmp_path, kind, force, more=""):
    (tmp_path / "world.toml").write_text(WORLD.format(map=kind, force=force, more=more))
    return running(tmp_path / "world.toml", tmp_path / "ports", seed=1)


def test_minimalmodbus_reads_our_transmitters(tmp_path, third_party):
    minimalmodbus = third_party("minimalmodbus")
    with bench(tmp_path, "laumas", -49.0) as ours:
        client = minimalmodbus.Instrument(str(ours.links / "cell"), 1)
        client.serial.baudrate, client.serial.timeout = 115200, 2.0
        try:
            assert client.read_long(7) == pytest.approx(49.0 / G * 1000, abs=1)
            assert client.read_register(6) & 0x180 == 0x180
            with pytest.raises(minimalmodbus.IllegalRequestError):
                client.read_register(0x200)
            ours.tell("fault cell busy")
            with pytest.raises(minimalmodbus.SlaveDeviceBusyError):
                client.read_register(6)
            ours.tell("fault cell bad_crc")
            with pytest.raises(minimalmodbus.InvalidResponseError):
                client.read_register(6)
            ours.tell("fault cell silent")
            with pytest.raises(minimalmodbus.NoResponseError):
                client.read_register(6)
        finally:
            client.serial.close()
    with bench(tmp_path, "seneca_z_sg", 49.0, 'unit = "N"\nword_order = "low_first"') as ours:
        client = minimalmodbus.Instrument(str(ours.links / "cell"), 1)
        client.serial.baudrate, client.serial.timeout = 115200, 2.0
        try:
            assert client.read_float(63, byteorder=minimalmodbus.BYTEORDER_LITTLE_SWAP) == pytest.approx(49.0, abs=0.01)
        finally:
            client.serial.close()


def test_pymodbus_reads_our_transmitters(tmp_path, third_party):
    modbus = third_party("pymodbus.client")
    with (
        bench(tmp_path, "dini_argeo_dgt", 49.0) as ours,
        modbus.ModbusSerialClient(str(ours.links / "cell"), baudrate=115200, timeout=2.0) as client,
    ):
        words = client.read_input_registers(0, count=5, device_id=1).registers
        assert client.convert_from_registers(words[:2], client.DATATYPE.UINT32) == pytest.approx(49.0 / G * 1000, abs=1)
        assert words[4] & 0b11011 == 0
        assert client.read_holding_registers(0, count=5, device_id=1).isError()


@pytest.mark.parametrize("kind", ["laumas", "dini_argeo_dgt", "seneca_z_sg"])
def test_our_driver_and_our_transmitter(tmp_path, kind):
    with bench(tmp_path, kind, -49.0) as ours:
        cell = ModbusCell("cell", told(str(ours.links / "cell"), kind, timeout=0.25))
        cell.open()
        assert collect(cell, 3)[-1].values[0] == pytest.approx(-49.0, abs=0.02)
        for fault in ("overload", "silent", "bad_crc", "wrong_address", "busy"):
            ours.tell(f"fault cell {fault}")
            before = cell.health().bad
            wait_until(lambda f=fault, b=before: _shows(cell, f, b))
            ours.tell("clear cell")
            wait_until(lambda: any(s.values[0] == pytest.approx(-49.0, abs=0.02) for s in cell.drain()))
        assert cell.health().alive
        ours.tell("fault cell pulled")
        wait_until(lambda: cell.drain() is not None and not cell.health().alive)
        cell.close()


def _shows(cell, fault, before):
    """What a driver can see of it: rows without a number, or requests without a row."""
    rows = cell.drain()
    return any(row.values[0] != row.values[0] for row in rows) if fault == "overload" else cell.health().bad > before


METER = """
title = "Meter"
source = "made up for this test"
function = {function}
word_order = "low_first"
[channels.bus_voltage]
register = 0
type = "u16"
scale = 0.01
unit = "V"
quantity = "bus_voltage"
[channels.water_temperature]
register = 1
type = "float32"
unit = "degC"
quantity = "water_temperature"
[channels.emergency_stop]
register = 3
type = "u16"
bit = 0
invert = true
unit = "1"
quantity = "emergency_stop"
"""


def meter(tmp_path, port, function):
    (tmp_path / "meter.toml").write_text(METER.format(function=function))
    return RegistersOptions(port, str(tmp_path / "meter.toml"), rate=40.0, baud=115_200, timeout=1.0)


@pytest.mark.parametrize(("block", "function"), [("hr", 3), ("ir", 4)])
def test_our_registers_against_the_server_of_pymodbus(tmp_path, block, function, third_party):
    third_party("pymodbus.server")
    words = struct.unpack(">HH", struct.pack(">f", 18.25))
    with Server([4823, *reversed(words), 1, 0, 0], block) as server:
        device = ModbusRegisters("meter", meter(tmp_path, server.port, function))
        device.open()
        assert collect(device, 5)[-1].values == pytest.approx((48.23, 18.25, 0.0))
        assert (device.health().bad, device.health().alive) == (0, True)
        device.close()


SLAVE = """
kind = "modbus_registers"
port = "cell"
baud = 115200
word_order = "low_first"
values = ["0 u16 bus_voltage 0.01", "1 float32 water_temperature 1", "3 u16 contact 1"]
"""


def test_minimalmodbus_reads_our_registers_and_so_do_we(tmp_path, third_party):
    minimalmodbus = third_party("minimalmodbus")
    head, _, _ = WORLD.format(map="", force=0.0, more="").partition("[devices.cell]")
    (tmp_path / "world.toml").write_text(f"{head}[devices.cell]{SLAVE}")
    with running(tmp_path / "world.toml", tmp_path / "ports", seed=1) as ours:
        client = minimalmodbus.Instrument(str(ours.links / "cell"), 1)
        client.serial.baudrate, client.serial.timeout = 115200, 2.0
        try:
            assert client.read_register(0, 2) == pytest.approx(48.0, abs=0.5)
            swapped = client.read_float(1, byteorder=minimalmodbus.BYTEORDER_LITTLE_SWAP)
            assert swapped == pytest.approx(18.0, abs=0.5)
            with pytest.raises(minimalmodbus.IllegalRequestError):
                client.read_register(9)
        finally:
            client.serial.close()
        device = ModbusRegisters("meter", meter(tmp_path, str(ours.links / "cell"), 3))
        device.open()
        assert collect(device, 2)[-1].values == pytest.approx((48.0, 18.0, 0.0), abs=0.5)
        ours.tell("fault cell pressed")
        wait_until(lambda: any(row.values[2] == 1.0 for row in device.drain()))
        device.close()
