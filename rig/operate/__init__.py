"""From a campaign file to a finished campaign and its table: `rig check`, `run`, `resume`, `settle`, `stop`."""
