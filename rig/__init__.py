"""The bench and its operator: configuration, sequencing, safety, recording, console."""
