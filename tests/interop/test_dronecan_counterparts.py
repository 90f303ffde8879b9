"""DroneCAN: the library's own node as ESC against our driver, and as client against our simulated ESC."""

from __future__ import annotations

import threading
import time

import can
import pytest

from drivers.dronecan.options import Options
from drivers.ports.can_bus import CanBus
from sim_devices.instruments.dronecan.esc import DronecanEsc as SimulatedEsc
from sim_devices.instruments.dronecan.options import DronecanEscOptions, Measured
from sim_devices.wires.can_frame import CanFrame
from tests.drivers.scripted_peer import wait_until

pytestmark = pytest.mark.interop


class TheirNode:
    """dronecan.node.Node in a thread of its own, over its driver interface on python-can's virtual bus."""

    def __init__(self, library, channel, node_id, set_up):
        from dronecan.driver.common import AbstractDriver, CANFrame

        bus = self._bus = can.Bus(channel, interface="virtual")

        class Virtual(AbstractDriver):
            def receive(self, timeout=None):
                message = bus.recv(timeout)
                if message is None:
                    return None
                now = time.monotonic()
                data = bytes(message.data)
                return CANFrame(message.arbitration_id, data, message.is_extended_id, ts_monotonic=now, ts_real=now)

            def send_frame(self, frame):
                data = bytes(frame.data)
                bus.send(can.Message(arbitration_id=frame.id, is_extended_id=frame.extended, data=data))

            def close(self):
                bus.shutdown()

        info = library.uavcan.protocol.GetNodeInfo.Response()
        info.name.encode("org.theirs")
        info.hardware_version.unique_id.from_bytes(bytes(range(16)))
        self.node = library.node.Node(
            Virtual(), node_id=node_id, node_status_interval=0.05, mode=0, node_info=info,
            catch_handler_exceptions=False,
        )  # fmt: skip
        self._set_up, self.errors = set_up, []
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def _run(self):
        self._set_up(self.node)
        try:
            while not self._stop.is_set():
                self.node.spin(0.005)
        except Exception as error:  # noqa: BLE001  top of a thread: told to the test
            self.errors.append(error)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._stop.set()
        self._thread.join()
        self.node.close()
        assert self.errors == []


@pytest.fixture
def library(third_party):
    return third_party("dronecan")


def test_our_driver_turns_their_esc(request, library):
    from drivers.dronecan.esc import DronecanEsc

    esc = library.uavcan.equipment.esc
    heard, armed, states = [], [], []

    def set_up(node):
        def status():
            cmd = [each for kind, each in heard if kind == "raw"]
            rpm = cmd[-1][0] // 4 if cmd and cmd[-1] else 0
            node.broadcast(esc.Status(voltage=48.0, current=2.5, temperature=320.0, rpm=rpm, power_rating_pct=12))

        node.periodic(0.02, status)
        node.add_handler(esc.RawCommand, lambda event: heard.append(("raw", list(event.message.cmd))))
        node.add_handler(esc.RPMCommand, lambda event: heard.append(("rpm", list(event.message.rpm))))
        arming = library.uavcan.equipment.safety.ArmingStatus
        node.add_handler(arming, lambda event: armed.append(event.message.status))
        node.add_handler(library.uavcan.protocol.NodeStatus, lambda event: states.append(event.transfer.source_node_id))

    bus = CanBus("virtual", request.node.name, 1_000_000)
    bus.open()
    try:
        with TheirNode(library, request.node.name, 42, set_up):
            device = DronecanEsc("motor", Options("b", 42, 24.0, 48.0, 0.5, reversible=True, arming=True), bus)
            identity = device.open()
            assert identity.startswith("org.theirs, node 42")
            assert identity.endswith("serial 000102030405060708090a0b0c0d0e0f")
            for volts in (0.0, 12.0, -12.0):
                device.command(volts)
            wait_until(lambda: len(heard) == 3)
            assert heard == [("raw", [0]), ("raw", [2048]), ("raw", [-2048])]
            assert (armed, states) == ([255], [10])
            rows = []
            wait_until(lambda: rows.extend(device.drain()) or any(row.values[0] == -512 / 60.0 for row in rows))
            last = [row for row in rows if row.stream == "motor"][-1]
            assert last.values[1:5] == pytest.approx((48.0, 2.5, 46.85, 0.12), abs=0.01)
            assert device.health().alive
            assert device.health().bad == 0
            device.release()
            wait_until(lambda: heard[-1] == ("raw", []))
            assert heard[-2] == ("rpm", [0])
            wait_until(lambda: armed[-1] == 0)
            device.close()
    finally:
        bus.close()


class Ours:
    """Our ESC on python-can's virtual bus, in real time."""

    def __init__(self, channel):
        turned = Measured(12.5, 1.5, 48.0, 30.0)
        self.log = []
        self.esc = SimulatedEsc(
            DronecanEscOptions("dronecan_esc", esc_index=9, state_rate=20.0, timeout=0.3), 48.0, lambda: 1.0,
            lambda: turned, lambda event, **more: self.log.append((event, more)),
        )  # fmt: skip
        self._bus = can.Bus(channel, interface="virtual")
        self._stop, self._t = threading.Event(), 0.0
        self._thread = threading.Thread(target=self._run)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._stop.set()
        self._thread.join()
        self._bus.shutdown()

    def _run(self):
        while not self._stop.wait(0.005):
            self._t += 0.005
            frames = list(self.esc.tick(self._t))
            while (message := self._bus.recv(0.0)) is not None:
                heard = CanFrame(message.arbitration_id, bytes(message.data), message.is_extended_id)
                frames += self.esc.receive(heard, self._t)
            for frame in frames:
                self._bus.send(can.Message(arbitration_id=frame.id, is_extended_id=True, data=frame.data))


def test_their_node_drives_our_esc(request, library):
    esc = library.uavcan.equipment.esc
    statuses, states, infos, commanding = [], [], [], threading.Event()

    def set_up(node):
        node.add_handler(esc.Status, lambda event: statuses.append(event.message))
        node.add_handler(library.uavcan.protocol.NodeStatus, lambda event: states.append(event.message))
        node.request(library.uavcan.protocol.GetNodeInfo.Request(), 42, infos.append)

        def command():
            if commanding.is_set():
                node.broadcast(esc.RawCommand(cmd=[0] * 9 + [-4096]))  # ten ESCs: a transfer of three frames

        node.periodic(0.02, command)

    with Ours(request.node.name) as ours, TheirNode(library, request.node.name, 10, set_up):
        wait_until(lambda: infos and statuses and states)
        assert infos[0].response.name.decode() == "org.example.esc"
        assert bytes(infos[0].response.hardware_version.unique_id) == bytes(range(16))
        assert (states[0].health, states[0].mode) == (0, 0)
        told = statuses[-1]
        assert (told.voltage, told.current, told.rpm, told.esc_index) == (48.0, 1.5, 750, 9)
        assert told.temperature == pytest.approx(303.15, abs=0.13)
        commanding.set()
        wait_until(lambda: ours.esc.volts == pytest.approx(-24.0, abs=0.01))
        wait_until(lambda: statuses[-1].power_rating_pct == 50)
        commanding.clear()
        wait_until(lambda: ours.esc.volts is None)
        assert [event for event, _ in ours.log if event == "timeout"]


def test_signatures_are_theirs(library):
    from sim_devices.instruments.dronecan.wire import SIGNATURES

    esc, protocol = library.uavcan.equipment.esc, library.uavcan.protocol
    kinds = {"Status": esc.Status, "RawCommand": esc.RawCommand, "RPMCommand": esc.RPMCommand}
    kinds["GetNodeInfo"] = protocol.GetNodeInfo
    assert {name: kind.get_data_type_signature() for name, kind in kinds.items()} == SIGNATURES
