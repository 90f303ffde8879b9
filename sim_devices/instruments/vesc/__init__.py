"""A VESC, as it talks on CAN."""
