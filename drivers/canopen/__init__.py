"""CANopen devices: a CiA 402 drive, a CiA 404 load cell, a CiA 401 analogue output; SDO frames in, SI numbers out."""
