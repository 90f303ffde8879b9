"""The state machine of a CiA 402 drive: what its statusword says, and which controlword is the next. Pure.

Source: CiA 402-2 / IEC 61800-7-201, "Power drive system state machine"; refereed in the tests by the tables of
`canopen.profiles.p402`.
"""

from __future__ import annotations

from enum import Enum

DISABLE_VOLTAGE, QUICK_STOP, SHUTDOWN, SWITCH_ON, ENABLE_OPERATION, FAULT_RESET = 0x00, 0x02, 0x06, 0x07, 0x0F, 0x80
"""Controlwords."""


class State(Enum):
    """(mask, value) of the statusword; the words are those of the standard."""

    NOT_READY = (0x4F, 0x00)
    SWITCH_ON_DISABLED = (0x4F, 0x40)
    READY = (0x6F, 0x21)
    SWITCHED_ON = (0x6F, 0x23)
    OPERATION_ENABLED = (0x6F, 0x27)
    QUICK_STOP_ACTIVE = (0x6F, 0x07)
    FAULT_REACTION = (0x4F, 0x0F)
    FAULT = (0x4F, 0x08)

    def __str__(self) -> str:
        return self.name.lower().replace("_", " ")


def state_of(statusword: int) -> State | None:
    """None: a word that no state has."""
    return next((state for state in State if statusword & state.value[0] == state.value[1]), None)


def next_controlword(state: State | None, *, turning: bool) -> int:
    """The way to operation enabled, one step for each statusword; `turning` False: not farther than switched on, where
    the motor has no torque. A quick stop is left to end by itself, a fault is left alone."""
    match state:
        case State.SWITCH_ON_DISABLED:
            return SHUTDOWN
        case State.READY:
            return SWITCH_ON
        case State.SWITCHED_ON | State.OPERATION_ENABLED:
            return ENABLE_OPERATION if turning else SWITCH_ON
        case State.QUICK_STOP_ACTIVE:
            return QUICK_STOP
        case _:
            return DISABLE_VOLTAGE
