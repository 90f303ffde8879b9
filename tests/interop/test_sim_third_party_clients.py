"""Programs that are not ours, against the simulated devices."""

import logging
from pathlib import Path

import pytest

from sim_devices.bench.process import running

WORLD = Path(__file__).parents[2] / "benches" / "simulated" / "world.toml"
pytestmark = pytest.mark.interop


@pytest.fixture
def bench(tmp_path):
    with running(WORLD, tmp_path / "ports", seed=1) as each:
        yield each


def test_labmcp_weighs_on_our_load_cell(bench, third_party):
    driver = third_party("labmcp_mettler_toledo.driver")
    transports = third_party("labmcp.transports.serial")
    transport = transports.SerialTransport(str(bench.links / "load_cell"), baudrate=38400)
    balance = driver.MTSICSBalance(transport)
    try:
        assert balance.identify() == {
            "manufacturer": "Mettler Toledo",
            "serial": "B021002593",
            "balance_data": "WXS-SIM 500 N",
            "software": "1.00 0.0.0.0",
            "model": "WXS-SIM",
            "mt_sics_level": "012",
        }
        weight = balance.weight(stable=False)
        assert (weight.unit, weight.value) == ("N", pytest.approx(0.75, abs=0.4))
        assert balance.weight(stable=True).stable
        balance.zero()
        assert balance.weight(stable=False).value == pytest.approx(0.0, abs=0.4)
        assert balance.preset_tare(1.0, "N").value == pytest.approx(1.0)
        balance.clear_tare()
        assert "B021002593" in balance.reset()
    finally:
        balance.close()


def test_pynmea2_reads_the_sentences_of_our_flow_meter(bench, third_party):
    """Signed velocities, checksum and form, by a parser that knows Nortek's sentences."""
    pynmea2, serial = third_party("pynmea2"), third_party("serial")
    with serial.Serial(str(bench.links / "flow"), 9600, timeout=5.0) as port:
        port.readline()  # where it was joined
        told = [pynmea2.parse(port.readline().decode("ascii").strip(), check=True) for _ in range(3)]
    for sentence in told:
        assert (type(sentence).__name__, sentence.cn, sentence.cp) == ("NORC1", 1, 0.5)
        assert all(abs(each) < 0.2 for each in (sentence.vx, sentence.vy, sentence.vz, sentence.vz2))
        assert (sentence.amp1, sentence.amp4) == (68.0, 68.0)
        assert (sentence.r1, sentence.r4) == (97, 97)
    assert len({sentence.vx for sentence in told}) > 1, "its noise"


def test_pybldc_finds_our_vesc_through_our_adapter(bench, third_party):
    pybldc = third_party("pybldc")
    client = pybldc.PyBldcCan(logging.getLogger("pybldc"), 23, interface="slcan", channel=str(bench.links / "can0"))
    try:
        assert client.ping(timeout=5.0)
    finally:
        client.shutdown()


def test_python_can_hears_our_vesc_and_turns_it(bench, third_party):
    can = third_party("can")
    with can.Bus(interface="slcan", channel=str(bench.links / "can0"), bitrate=500000, sleep_after_open=0) as bus:
        duty = bytes.fromhex("000061a8")  # 0.25: 12 V
        erpm = 0
        for _ in range(1500):
            bus.send(can.Message(arbitration_id=0x17, data=duty, is_extended_id=True))
            message = bus.recv(1.0)
            assert message is not None
            assert message.is_extended_id
            if message.arbitration_id == 0x917:
                erpm = int.from_bytes(message.data[:4], "big", signed=True)
                if abs(erpm - 12.0 * 60 * 7) < 20:
                    break
        assert erpm == pytest.approx(12.0 * 60 * 7, abs=20)


def test_minimalmodbus_reads_our_transmitter(bench, third_party):
    minimalmodbus = third_party("minimalmodbus")
    instrument = minimalmodbus.Instrument(str(bench.links / "thermometer"), 1)
    instrument.serial.baudrate = 9600
    instrument.serial.timeout = 2.0
    try:
        assert instrument.read_float(0x0002) == pytest.approx(1.04)
        assert instrument.read_float(0x0008) == pytest.approx(18.2, abs=0.1)
        with pytest.raises(minimalmodbus.IllegalRequestError):
            instrument.read_register(0x0050)
    finally:
        instrument.serial.close()


def test_pymodbus_reads_our_transmitter(bench, third_party):
    modbus = third_party("pymodbus.client")
    with modbus.ModbusSerialClient(str(bench.links / "thermometer"), baudrate=9600, timeout=2.0) as client:
        registers = client.read_holding_registers(0x0008, count=2, device_id=1).registers
        (value,) = (client.convert_from_registers(registers, client.DATATYPE.FLOAT32),)
        assert value == pytest.approx(18.2, abs=0.1)
        assert client.read_holding_registers(0x0050, count=2, device_id=1).isError()
