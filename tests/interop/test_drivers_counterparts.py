"""Our drivers against devices that other people wrote: mt-sics-emulator, labmcp, pyvesc, pymodbus's server."""

from __future__ import annotations

import asyncio
import os
import threading
import tty
import warnings

import pytest

from drivers.modbus import keller
from drivers.serial_lines.mt_sics import MtSics, Options
from drivers.vesc.can_frames import set_current, set_duty
from tests.drivers.scripted_peer import Peer, wait_until

pytestmark = pytest.mark.interop


def drain(device, count):
    samples = []
    wait_until(lambda: len(samples.extend(device.drain()) or samples) >= count)
    return samples


@pytest.mark.parametrize(("profile", "newtons"), [("mt-ms3002s", 1e-3 * 9.80665), ("mt-ind570", 9.80665)])
def test_mt_sics_emulator(profile, newtons, third_party):
    """Its deviations (identifier SI, I2 = serial number, no UPD) are accepted; none of them is needed."""
    profiles = third_party("mtsics.profiles")
    from mtsics.core.state import ScaleState
    from mtsics.protocol.engine import MTSICSEngine

    state = ScaleState(config=profiles.load(profile))
    engine = MTSICSEngine(state)
    state.set_weight(12.5)

    def script(peer, request):
        peer.send(engine.handle(request.decode()).encode())
        peer.streaming = engine.handle("SI").encode() if engine.sir_active else None

    with Peer(script) as peer:
        device = MtSics("cell", Options(peer.port, rate=20.0, set_rate=False, timeout=1.0))
        assert state.config.serial_number in device.open()
        assert drain(device, 3)[-1].values == pytest.approx((12.5 * newtons, 1.0))
        device.tare()
        wait_until(lambda: any(abs(s.values[0]) < 1e-9 for s in device.drain()))
        state.set_weight(1e9)
        peer.streaming = engine.handle("SI").encode()
        wait_until(lambda: any(s.values[0] != s.values[0] for s in device.drain()))
        assert device.health().bad == 0
        device.close()


def test_labmcp_balance(third_party):
    """It has no SIR; the script repeats its SI, as a device with SIR does."""
    simulator = third_party("labmcp_mettler_toledo.simulator").MTSICSSimulator(load_g=50.0)

    def script(peer, request):
        command = request.decode()
        if command == "SIR":
            peer.streaming = f"{simulator.handle('SI')}\r\n".encode()
        else:
            peer.send(f"{simulator.handle(command)}\r\n".encode())

    with Peer(script) as peer:
        device = MtSics("cell", Options(peer.port, rate=20.0, set_rate=False, unit="g", timeout=1.0))
        assert device.open() == "XS205DU Excellence 220.0000 g, serial number B123456789"
        value, stable = drain(device, 2)[-1].values
        assert value == pytest.approx(0.050 * 9.80665, abs=1e-5)
        assert stable == 0.0
        device.tare()
        assert simulator.tare_g == 50.0
        device.close()


def test_set_commands_carry_the_bytes_of_pyvesc(third_party):
    """The same command by UART is 02 length id payload crc 03; on CAN the payload is the frame's data."""
    pyvesc = third_party("pyvesc")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for duty in (0.25, -0.5, 0.0, 0.9):
            assert pyvesc.encode(pyvesc.SetDutyCycle(round(duty * 1e5)))[3:-3] == set_duty(23, duty).data
        for amperes in (0.0, 5.0, -12.5):
            assert pyvesc.encode(pyvesc.SetCurrent(round(amperes * 1e3)))[3:-3] == set_current(23, amperes).data


@pytest.fixture
def pymodbus_server():
    """pymodbus's own serial server at one end of a pty; yields the path of the other."""
    from pymodbus.datastore import ModbusDeviceContext, ModbusSequentialDataBlock, ModbusServerContext
    from pymodbus.server import ModbusSerialServer

    registers = [0] * 12
    registers[2:4] = [0x3F80, 0x0000]  # 1.0 bar
    registers[8:10] = [0x4192, 0x0000]  # 18.25 degC
    master, slave = os.openpty()
    tty.setraw(slave)
    tty.setraw(master)
    other_master, other_slave = os.openpty()
    tty.setraw(other_slave)
    stop, ready = threading.Event(), threading.Event()

    def pump(source, sink):
        import select

        while not stop.is_set():
            if select.select([source], [], [], 0.01)[0]:
                os.write(sink, os.read(source, 4096))

    async def serve():
        block = ModbusSequentialDataBlock(1, registers)
        context = ModbusServerContext(devices={1: ModbusDeviceContext(hr=block)}, single=False)
        server = ModbusSerialServer(context, port=os.ttyname(other_slave), baudrate=115_200)
        await server.serve_forever(background=True)
        ready.set()
        while not stop.is_set():
            await asyncio.sleep(0.01)
        await server.shutdown()

    threads = [
        threading.Thread(target=asyncio.run, args=(serve(),)),
        threading.Thread(target=pump, args=(master, other_master)),
        threading.Thread(target=pump, args=(other_master, master)),
    ]
    for thread in threads:
        thread.start()
    ready.wait(5.0)
    yield os.ttyname(slave)
    stop.set()
    for thread in threads:
        thread.join()
    for descriptor in (master, slave, other_master, other_slave):
        os.close(descriptor)


def test_keller_against_the_server_of_pymodbus(pymodbus_server):
    device = keller.Keller("thermometer", keller.Options(pymodbus_server, rate=20.0, baud=115_200, timeout=1.0))
    device.open()
    assert drain(device, 3)[-1].values == (18.25, 1e5)
    assert device.health().bad == 0
    device.close()
