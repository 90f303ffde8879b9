"""SDO transfers by the library `canopen`, over the bus that the rig has opened: no thread and no socket of its own.

The library's client asks a `Network` to send and waits on a queue that a notifier thread fills. Here it sends by
`CanBus` and waits on the device's own inbox, in the time of whoever opened the bus (docs/decisions/0022).
"""

from __future__ import annotations

from canopen.objectdictionary import ObjectDictionary
from canopen.sdo.client import SdoClient
from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

from drivers.canopen.frames import SDO_REPLY, SDO_REQUEST
from drivers.errors import LinkError
from drivers.ports.can_bus import CanBus
from drivers.ports.can_frame import Frame
from drivers.ports.inbox import Inbox

ABSENT = (0x06020000, 0x06090011)
"""Abort codes: no such object, no such sub-index."""

__all__ = ["ABSENT", "SdoAbortedError", "SdoCommunicationError", "SdoOverBus"]


class SdoOverBus(SdoClient):
    """The library's client for one node. Raises its errors, and LinkError when the bus is lost."""

    def __init__(self, node_id: int, bus: CanBus, inbox: Inbox[Frame], timeout: float) -> None:
        """`timeout`: s for each reply."""
        SdoClient.__init__(self, SDO_REQUEST + node_id, SDO_REPLY + node_id, ObjectDictionary())
        self._bus, self._inbox, self._timeout = bus, inbox, timeout

    def send_request(self, request: bytes) -> None:
        """Send, and forget what came in reply to an earlier request that was given up."""
        while self._inbox.wait_for(self._is_reply, 0.0) is not None:
            pass
        self._bus.send(Frame(self.rx_cobid, False, bytes(request)))

    def read_response(self) -> bytes:
        frame = self._inbox.wait_for(self._is_reply, self._timeout)
        if frame is None:
            if not self._bus.alive:
                raise LinkError(f"its CAN bus was lost: {self._bus.error or 'it was closed'}")
            raise SdoCommunicationError("no reply")
        if frame.data[0] == 0x80:  # abort: command, index, sub-index, code
            raise SdoAbortedError(int.from_bytes(frame.data[4:8], "little"))
        return frame.data

    def _is_reply(self, frame: Frame) -> bool:
        return frame.id == self.tx_cobid and len(frame.data) == 8
