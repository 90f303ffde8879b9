"""CANopen on python-can's virtual bus: nodes of durand, our simulated ones, and dictionaries of `canopen`."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from uuid import uuid4

import can

from sim_devices.instruments.can_node import CanNode
from sim_devices.wires.can_frame import CanFrame

TURN = 0.005
"""s between two turns of a node's own thread."""


def channel() -> str:
    """A bus of its own for each test."""
    return f"interop-{uuid4()}"


class Running:
    """Calls `turn` every few milliseconds in a thread until the context ends; what it raises ends the test."""

    def __init__(self, turn: Callable[[], None], close: Callable[[], None]) -> None:
        self._turn, self._close = turn, close
        self._stop = threading.Event()
        self._error: Exception | None = None

    def _run(self) -> None:
        try:
            while not self._stop.wait(TURN):
                self._turn()
        except Exception as error:  # noqa: BLE001 - the top of a thread: the test is told
            self._error = error

    def __enter__(self):
        self._thread = threading.Thread(target=self._run)
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._stop.set()
        self._thread.join()
        self._close()
        assert self._error is None, self._error


def durand_node(name: str, node_id: int, fill: Callable[[object], Callable[[float], None]]) -> Running:
    """A durand node on bus `name`: `fill(node)` makes its dictionary and gives what it does every few ms, told the
    time. Its event timers are ours: durand has none."""
    from durand import CANBusNetwork, MinimalNode, Variable, set_scheduler
    from durand.datatypes import DatatypeEnum
    from durand.scheduler import VirtualScheduler

    scheduler = VirtualScheduler()
    set_scheduler(scheduler)
    bus = can.Bus(name, interface="virtual")
    network = CANBusNetwork(bus)
    node = MinimalNode(network, node_id)
    for number in range(4):
        node.object_dictionary[0x1800 + number][5] = Variable(DatatypeEnum.UNSIGNED16, "rw", 0, name="Event Timer")
    act = fill(node)
    begun = time.monotonic()
    last = [begun]

    def turn() -> None:
        now = time.monotonic()
        scheduler.run(now - last[0])
        last[0] = now
        act(now - begun)

    def close() -> None:
        network.stop()
        bus.shutdown()

    return Running(turn, close)


def simulated(name: str, node: CanNode, world: Callable[[float], None] = lambda _: None) -> Running:
    """One of our simulated nodes on bus `name`, in the machine's time. `world(dt)` goes on beside it."""
    bus = can.Bus(name, interface="virtual")
    begun = time.monotonic()
    last = [0.0]

    def send(frames) -> None:
        for each in frames:
            bus.send(can.Message(arbitration_id=each.id, data=each.data, is_extended_id=each.extended))

    def turn() -> None:
        while (message := bus.recv(0.0)) is not None:
            frame = CanFrame(message.arbitration_id, bytes(message.data), message.is_extended_id)
            send(node.receive(frame, time.monotonic() - begun))
        now = time.monotonic() - begun
        world(now - last[0])
        last[0] = now
        send(node.tick(now))

    return Running(turn, bus.shutdown)


def dictionary(objects):
    """The dictionary of `canopen` for objects of a simulated node, as its EDS would give it."""
    from canopen.objectdictionary import ObjectDictionary, ODArray, ODRecord, ODVariable, datatypes

    forms = {
        "b": datatypes.INTEGER8,
        "h": datatypes.INTEGER16,
        "i": datatypes.INTEGER32,
        "B": datatypes.UNSIGNED8,
        "H": datatypes.UNSIGNED16,
        "I": datatypes.UNSIGNED32,
        "f": datatypes.REAL32,
        "s": datatypes.VISIBLE_STRING,
    }
    made = ObjectDictionary()
    for index in sorted({index for index, _ in objects}):
        subs = sorted(sub for each, sub in objects if each == index)
        variables = []
        for sub in subs:
            variable = ODVariable(f"{index:04X}:{sub}", index, sub)
            variable.data_type = forms[objects[index, sub].form]
            variables.append(variable)
        if subs == [0]:
            made.add_object(variables[0])
            continue
        record = (ODRecord if 0x1400 <= index < 0x1C00 or index == 0x1018 else ODArray)(f"{index:04X}", index)
        for variable in variables:
            record.add_member(variable)
        made.add_object(record)
    return made
