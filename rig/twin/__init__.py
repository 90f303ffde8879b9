"""From a twin to its file and back, and to the recording that it predicts: `rig simulate`."""
