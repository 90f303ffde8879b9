"""Errors an operator sees. Each is one sentence: who, what was expected, what came, what to do. Exit status 2."""


class RigError(Exception):
    """Base of what is the input's or the bench's fault, not the program's."""


class ConfigError(RigError):
    """A bench or campaign file: names file and key."""


class PlanError(RigError):
    """A plan that may not run: a limit exceeded, a level out of range, a negative dwell."""


class LinkError(RigError):
    """A process or wire that is gone or does not answer."""


class DeviceError(RigError):
    """A device that answers wrongly or refuses."""


class RecordingError(RigError):
    """A file that is not a recording, is of a later version, or lacks what is asked of it."""


class UnreadError(RecordingError):
    """A file whose reading was ended by something else than what is in it, of which nothing is known: to ask again."""


class TwinError(RigError):
    """A file that is not a twin, or a twin that does not suit what is asked of it."""
