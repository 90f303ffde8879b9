"""Instruments that answer Modbus RTU."""
