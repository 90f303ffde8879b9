"""Instruments that are asked by Modbus RTU: one codec, one poll, register maps as files."""
