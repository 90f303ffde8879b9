"""ODrive: our frames by the maker's DBC files, our driver against odrive-can's mock, its client against our axis."""

from __future__ import annotations

import asyncio
import struct
import threading
from pathlib import Path

import can
import pytest

from drivers.odrive.can_frames import (
    Bus,
    Encoder,
    Heartbeat,
    clear_errors,
    decode,
    set_mode,
    set_state,
    set_torque,
    set_velocity,
)
from drivers.odrive.options import Options
from drivers.odrive.over_can import ODriveCan
from drivers.ports.can_bus import CanBus
from drivers.ports.can_frame import Frame
from sim_devices.instruments.odrive.axis import ODriveAxis
from sim_devices.instruments.odrive.options import Measured, ODriveOptions
from sim_devices.wires.can_frame import CanFrame
from tests.drivers.scripted_peer import wait_until

pytestmark = pytest.mark.interop


@pytest.fixture(scope="module")
def dbc():
    package = pytest.importorskip("odrive_can", reason="odrive_can is not installed (pip install -e .[test])")
    database = pytest.importorskip("cantools.database")
    return database.load_file(Path(package.__file__).parent / "dbc" / "odrive-cansimple-0.6.10.dbc")


@pytest.mark.parametrize(
    ("frame", "name", "signals"),
    [
        (set_velocity(3, -12.5), "Set_Input_Vel", {"Input_Vel": -12.5, "Input_Torque_FF": 0.0}),
        (set_torque(3, 0.25), "Set_Input_Torque", {"Input_Torque": 0.25}),
        (set_state(3, 8), "Set_Axis_State", {"Axis_Requested_State": "CLOSED_LOOP_CONTROL"}),
        (set_state(3, 1), "Set_Axis_State", {"Axis_Requested_State": "IDLE"}),
        (set_mode(3, 2, 1), "Set_Controller_Mode", {"Control_Mode": "VELOCITY_CONTROL", "Input_Mode": "PASSTHROUGH"}),
        (set_mode(3, 1, 1), "Set_Controller_Mode", {"Control_Mode": "TORQUE_CONTROL", "Input_Mode": "PASSTHROUGH"}),
        (clear_errors(3), "Clear_Errors", {"Identify": 0}),
    ],
)
def test_our_commands_by_the_dbc(dbc, frame, name, signals):
    message = dbc.get_message_by_name(f"Axis3_{name}")
    assert message.frame_id == frame.id
    assert {key: str(value) for key, value in message.decode(frame.data[: message.length]).items()} == {
        key: str(value) for key, value in signals.items()
    }


def test_their_messages_by_ours(dbc):
    def made(name, **signals):
        message = dbc.get_message_by_name(f"Axis3_{name}")
        return Frame(message.frame_id, False, message.encode(signals))

    beat = made("Heartbeat", Axis_Error=0x1000000, Axis_State=8, Procedure_Result=0, Trajectory_Done_Flag=1)
    assert decode(beat) == Heartbeat(0x1000000, 8, (0, 1, 0))
    assert decode(made("Get_Encoder_Estimates", Pos_Estimate=1.5, Vel_Estimate=-2.5)) == Encoder(1.5, -2.5)
    assert decode(made("Get_Bus_Voltage_Current", Bus_Voltage=48.0, Bus_Current=-1.0)) == Bus(48.0, -1.0)


def test_the_frames_of_our_axis_by_the_dbc(dbc):
    axis = ODriveAxis(
        ODriveOptions("odrive", 3, temperature=10.0), 48.0, lambda: 1.0,
        lambda: Measured(-12.5, 1.5, 0.5, 48.0, 30.0, 40.0), lambda event, **more: None,
    )  # fmt: skip
    said = {}
    for frame in axis.tick(0.1001):
        message = dbc.get_message_by_frame_id(frame.id)
        said[message.name] = {key: str(value) for key, value in message.decode(frame.data).items()}
    assert said["Axis3_Heartbeat"]["Axis_State"] == "IDLE"
    assert said["Axis3_Get_Encoder_Estimates"]["Vel_Estimate"] == "-12.5"
    assert said["Axis3_Get_Iq"]["Iq_Measured"] == "1.5"
    assert said["Axis3_Get_Bus_Voltage_Current"] == {"Bus_Voltage": "48.0", "Bus_Current": "0.5"}
    assert said["Axis3_Get_Temperature"] == {"FET_Temperature": "30.0", "Motor_Temperature": "40.0"}


class Mock:
    """odrive-can's ODriveCANMock in a loop of its own. It answers in 0.5 s, and sends heartbeat and encoder alone."""

    def __init__(self, module, channel):
        self.mock = None
        self._module, self._channel = module, channel
        self._thread = threading.Thread(target=asyncio.run, args=(self._main(),))
        self._stop = threading.Event()

    def __enter__(self):
        self._thread.start()
        wait_until(lambda: self.mock is not None)
        return self.mock

    def __exit__(self, *_):
        self._stop.set()
        self._thread.join()

    async def _main(self):
        bus = can.Bus(self._channel, interface="virtual")
        mock = self._module.ODriveCANMock(3, bus)
        mock.notifier.remove_listener(mock.can_reader)  # it would hand over from a thread what is the loop's own
        mock.notifier.stop()
        mock.notifier = can.Notifier(bus, [mock.can_reader], timeout=0.1, loop=asyncio.get_running_loop())
        tasks = [asyncio.create_task(each) for each in (mock.heartbeat_loop(0.02), mock.encoder_loop(0.01))]
        tasks.append(asyncio.create_task(mock.message_handler()))
        self.mock = mock
        while not self._stop.is_set():
            await asyncio.sleep(0.01)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        mock.notifier.stop()  # its thread hands frames to this loop, which ends here
        bus.shutdown()


def test_our_driver_against_the_mock_of_odrive_can(request, third_party):
    module = third_party("odrive_can.mock")
    bus = CanBus("virtual", request.node.name, 250_000)
    bus.open()
    try:
        with Mock(module, request.node.name) as mock:
            options = Options(
                "b", 3, 24.0, 2.0, rate_per_volt=2.0, current_rate=0.0, supply_rate=0.0, heartbeat_rate=50.0
            )
            device = ODriveCan("motor", options, bus)
            device.open()
            device.command(0.0)
            device.command(2.5)
            wait_until(lambda: mock.odrive.axis_state == "CLOSED_LOOP_CONTROL")
            assert mock.odrive.control_mode == "VELOCITY_CONTROL"
            assert mock.odrive.input_mode == "PASSTHROUGH"

            def turning():
                device.command(2.5)
                return any(row.stream == "motor" and row.values[0] == pytest.approx(5.0) for row in device.drain())

            wait_until(turning)
            device.release()
            wait_until(lambda: mock.odrive.axis_state == "IDLE")
            device.close()
    finally:
        bus.close()


class Node:
    """Our axis on python-can's virtual bus, in real time."""

    def __init__(self, channel):
        self.axis = ODriveAxis(
            ODriveOptions("odrive", 3, timeout=0.0), 48.0, lambda: 1.0,
            lambda: Measured(rotation_rate=self.axis.drive(0.0, 0.0)[0] or 0.0), lambda event, **more: None,
        )  # fmt: skip
        self._bus = can.Bus(channel, interface="virtual")
        self._stop, self._t = threading.Event(), 0.0
        self._thread = threading.Thread(target=self._run)

    def __enter__(self):
        self._thread.start()
        return self.axis

    def __exit__(self, *_):
        self._stop.set()
        self._thread.join()
        self._bus.shutdown()

    def _run(self):
        while not self._stop.wait(0.005):
            self._t += 0.005
            frames = list(self.axis.tick(self._t))
            while (message := self._bus.recv(0.0)) is not None:
                heard = CanFrame(
                    message.arbitration_id, bytes(message.data), message.is_extended_id, message.is_remote_frame
                )
                frames += self.axis.receive(heard, self._t)
            for frame in frames:
                self._bus.send(can.Message(arbitration_id=frame.id, is_extended_id=False, data=frame.data))


def test_the_client_of_odrive_can_drives_our_axis(request, third_party):
    module = third_party("odrive_can.odrive")

    async def drive(axis):
        client = module.ODriveCAN(3, can.Bus(request.node.name, interface="virtual"))
        await client.start()
        client.clear_errors()
        client.set_controller_mode("VELOCITY_CONTROL", "PASSTHROUGH")
        await client.set_axis_state("CLOSED_LOOP_CONTROL")
        client.set_input_vel(-7.5)
        client.check_errors()
        for _ in range(100):
            await asyncio.sleep(0.02)
            if axis.drive(0.0, 0.0)[0] == -7.5:
                break
        found = await client.get_bus_voltage_current()
        client.stop()
        await asyncio.sleep(0.05)
        return axis.drive(0.0, 0.0), found

    with Node(request.node.name) as axis:
        after, supply = asyncio.run(drive(axis))
    assert after == (None, 0.0), "stop() makes it idle"
    assert supply == {"Bus_Voltage": 48.0, "Bus_Current": 0.0}
    assert struct.pack("<f", 48.0) == b"\x00\x00\x40\x42"
