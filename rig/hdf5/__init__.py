"""The recording format, version 1, side by side: writing (write), reading (load), saving from a crash (recover)."""

from rig.hdf5.header import Header, headers, headers_in_batches
from rig.hdf5.load import identity_of, load, recording_id_of
from rig.hdf5.opening import is_hdf5
from rig.hdf5.recover import Loss, recover
from rig.hdf5.write import RecordingFile

__all__ = [
    "Header",
    "Loss",
    "RecordingFile",
    "headers",
    "headers_in_batches",
    "identity_of",
    "is_hdf5",
    "load",
    "recording_id_of",
    "recover",
]
