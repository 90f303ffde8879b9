"""Errors of the wires. Each says who, what was expected, what came, what to do."""


class LinkError(Exception):
    """The wire: a port that does not open, a cable that was pulled, a write that is refused."""


class DeviceError(Exception):
    """The device behind a working wire: it does not identify itself, refuses a setting, reports a fault."""
