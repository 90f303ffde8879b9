"""Signals of any CAN device that a DBC file describes. Needs the extra `dbc`."""
