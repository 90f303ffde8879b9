"""From an open bench and a decision per tick to commands, rows and snapshots: the loop, the one caller of `command`."""
