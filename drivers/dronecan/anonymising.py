"""What a DroneCAN node says of its owner: the unique id and certificate in its answer to GetNodeInfo."""

from __future__ import annotations

from collections.abc import Sequence

from dronecan import UAVCANException
from dronecan.transport import Frame as LibraryFrame
from dronecan.transport import Transfer

from drivers.dronecan.transfers import END, GET_NODE_INFO, SERVICE, START
from drivers.ports.can_frame import Frame, frame_of
from drivers.ports.transcript import Chunk

REQUEST = 1 << 15
"""In an identifier: it asks."""


def anonymise(chunks: Sequence[Chunk]) -> list[Chunk]:
    """Unique ids count from 1, certificates are zero, checksums are made anew; an answer that is not whole is refused.

    Raises ValueError for that, and for a node that asks for its identifier, which says its unique id too.
    """
    out, begun, names = list(chunks), dict[int, list[int]](), dict[bytes, int]()
    for at, chunk in enumerate(chunks):
        frame = frame_of(chunk.data)
        if frame.extended and frame.id & 0xFF == 0:
            raise ValueError(f"the frame {frame} is of a node without an identifier, which says its unique id")
        if not _is_answer(frame):
            continue
        places = begun[frame.id] = [*([] if frame.data[-1] & START else begun.get(frame.id, [])), at]
        if frame.data[-1] & END:
            for place, new in zip(places, _renamed([frame_of(chunks[p].data) for p in places], names), strict=True):
                out[place] = out[place]._replace(data=str(new).encode())
            del begun[frame.id]
    if begun:
        raise ValueError("an answer to GetNodeInfo is not whole, and may hold the unique id of its node")
    return out


def _is_answer(frame: Frame) -> bool:
    answers = frame.extended and bool(frame.id & SERVICE) and not frame.id & REQUEST
    return answers and frame.id >> 16 & 0xFF == GET_NODE_INFO and bool(frame.data)


def _renamed(frames: list[Frame], names: dict[bytes, int]) -> list[Frame]:
    transfer = Transfer()
    try:
        transfer.from_frames([LibraryFrame(frame.id, frame.data) for frame in frames])
    except (UAVCANException, ValueError, IndexError) as error:  # IndexError: shorter than its CRC or array
        raise ValueError(f"an answer to GetNodeInfo can't be read ({error}), and may hold the unique id") from error
    version = transfer.payload.hardware_version
    unique = bytes(version.unique_id)
    number = names.setdefault(unique, len(names) + 1)
    for place, byte in enumerate(number.to_bytes(len(unique), "big")):
        version.unique_id[place] = byte
    for place in range(len(version.certificate_of_authenticity)):
        version.certificate_of_authenticity[place] = 0
    again = Transfer(
        payload=transfer.payload, source_node_id=transfer.source_node_id, dest_node_id=transfer.dest_node_id,
        transfer_id=transfer.transfer_id, transfer_priority=transfer.transfer_priority, service_not_message=True,
        request_not_response=False,
    )  # fmt: skip
    made = [Frame(frame.message_id, True, bytes(frame.bytes)) for frame in again.to_frames()]
    if [frame.id for frame in made] != [frame.id for frame in frames]:
        raise ValueError("an answer to GetNodeInfo is made of other frames than this program would make of it")
    return made
