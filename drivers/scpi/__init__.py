"""Bench supplies that speak SCPI on a serial port."""
