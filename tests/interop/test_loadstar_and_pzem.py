"""Other people's programs at our Loadstar and our PZEM, and other people's slave at our PZEM driver."""

from __future__ import annotations

import asyncio

import pytest

from drivers.modbus.pzem import Options, Pzem
from drivers.serial_lines.loadstar import Loadstar
from drivers.serial_lines.loadstar import Options as LoadstarOptions
from sim_devices.bench.process import running
from tests.drivers.collecting import collect
from tests.interop.test_modbus_cells import Server

pytestmark = pytest.mark.interop
WORLD = """
mounted = "T1"
[thrusters]
T1 = { C = 0.4 }
[cell]
zero_offset = 12.5
[can]
adapters = []
[devices.cell]
kind = "loadstar"
port = "cell"
baud = 9600
unit = "N"
rate = 60.0
[devices.meter]
kind = "pzem"
port = "meter"
"""


@pytest.fixture
def bench(tmp_path):
    world = tmp_path / "world.toml"
    world.write_text(WORLD, encoding="utf-8")
    with running(world, tmp_path / "ports", seed=1) as each:
        yield each


@pytest.mark.filterwarnings("ignore:This function will be removed:DeprecationWarning")  # the client's use of pint
def test_the_client_of_janelia_reads_our_loadstar(bench, third_party):
    module = third_party("loadstar_sensors_interface")
    values = []

    async def take(value):
        values.append(value)

    async def session():
        device = module.LoadstarSensorsInterface()
        await device.open_low_speed_serial_connection(port=str(bench.links / "cell"))
        device.set_sensor_value_units("newton")
        info = await device.get_device_info()
        device.start_getting_sensor_values(take)
        await asyncio.sleep(1.0)
        await device.stop_getting_sensor_values()
        device._writer.close()  # it has no way of its own to let the port go
        await asyncio.sleep(0.1)
        return info

    info = asyncio.run(session())
    assert "FCM DI-1000" in str(info.model)
    assert len(values) > 20
    assert float(values[-1].to("newton").magnitude) == pytest.approx(12.5, abs=0.5)


def test_our_driver_reads_our_loadstar_on_a_pty(bench):
    device = Loadstar("cell", LoadstarOptions(str(bench.links / "cell"), rate=60.0))
    assert device.open() == "Loadstar FCM DI-1000, F1234-5678, capacity 500.00"
    assert collect(device, 10)[-1].values[0] == pytest.approx(12.5, abs=0.5)
    device.close()


def test_minimalmodbus_reads_our_pzem(bench, third_party):
    minimalmodbus = third_party("minimalmodbus")
    instrument = minimalmodbus.Instrument(str(bench.links / "meter"), 1)
    instrument.serial.baudrate, instrument.serial.stopbits, instrument.serial.timeout = 9600, 2, 2.0
    try:
        assert instrument.read_register(0, 2, functioncode=4) == pytest.approx(48.0, abs=0.1)
        assert instrument.read_registers(0, 8, functioncode=4)[1] == 0
        assert instrument.read_register(3, functioncode=3) == 0
        with pytest.raises(minimalmodbus.IllegalRequestError):
            instrument.read_register(20, functioncode=4)
    finally:
        instrument.serial.close()


def test_our_driver_reads_our_pzem_on_a_pty(bench):
    device = Pzem("meter", Options(str(bench.links / "meter"), shunt=100))
    device.open()
    assert collect(device, 3)[-1].values[:2] == (pytest.approx(48.0, abs=0.1), 0.0)
    device.close()


def test_our_pzem_driver_at_pymodbus(third_party):
    third_party("pymodbus")
    with Server([1254, 523, 6558, 0, 17, 0, 0, 0], "ir") as server:
        device = Pzem("meter", Options(server.port, timeout=2.0))
        device.open()
        assert collect(device, 2)[-1].values == pytest.approx((12.54, 5.23, 655.8, 17.0, 0.0))
        device.close()
