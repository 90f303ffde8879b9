"""CANopen devices: a node as CiA 301 has it, and on it a drive (CiA 402), a load cell (404), an output (401)."""
