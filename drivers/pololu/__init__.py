"""Pololu servo and motor controllers on a serial port: packets of command bytes, answers without any frame."""
