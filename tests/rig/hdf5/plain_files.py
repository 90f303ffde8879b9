"""A small recording as somebody else writes it, by plain h5py."""

import h5py
import numpy as np


def plain(path, **root):
    """What somebody else writes: ten lines of plain h5py."""
    with h5py.File(path, "w") as file:
        file.attrs.update({"format": "thruster-rig-recording", "format_version": 1, **root})
        for stream, quantity, unit, values in (
            ("drive", "command_voltage", "V", [0, 1, 2]),
            ("cell", "thrust", "N", [0.0, 1.0, 4.0]),
        ):
            group = file.create_group(f"streams/{stream}")
            group["time"] = np.arange(3.0)
            group[quantity] = values
            group[quantity].attrs.update({"quantity": quantity, "unit": unit})
    return path
