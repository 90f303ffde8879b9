"""What lies between device and host: bytes and frames go in; they come out at the far end, late or damaged if told."""
