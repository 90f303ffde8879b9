"""What is in a MATLAB file of version 7.3: HDF5 behind 512 bytes of MATLAB's own."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np


def content_of_mat(path: Path) -> dict[str, Any]:
    """Structs as mappings, arrays as MATLAB has them: in the file they lie the other way round. Raises OSError."""
    with h5py.File(path, "r") as file:
        return _content(file)


def _content(group: h5py.Group) -> dict[str, Any]:
    return {
        name: _content(each) if isinstance(each, h5py.Group) else np.asarray(each[()]).T
        for name, each in group.items()
        if not name.startswith("#")
    }
