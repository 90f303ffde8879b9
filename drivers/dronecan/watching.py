"""What the nodes of a DroneCAN bus say of themselves, and what of it is a fault of the motor controller.

Health, mode and uptime are 341.NodeStatus.uavcan's; error_count that of 1034.Status.uavcan ("resets when the motor
restarts"), which VESC's firmware fills with its fault code (libcanard/canard_driver.c).
"""

from __future__ import annotations

from drivers.dronecan.options import HEALTH, MODES, Options
from drivers.dronecan.transfers import NODE_STATUS, RAW_COMMAND, RPM_COMMAND, STATUS, Received

ERROR = 2
"""Health from which on the node itself says that it can't do its work; a warning is recorded alone."""
AGAIN = "open again"


class Watching:
    """Takes transfers, and has at most two sentences: one that stays until the next opening, one while it lasts."""

    def __init__(self, name: str, options: Options) -> None:
        self._name, self._options = name, options
        self._uptime: int | None = None
        self._errors: int | None = None
        self._stays: str | None = None
        self._now: str | None = None

    @property
    def fault(self) -> str | None:
        return self._stays or self._now

    def take(self, transfer: Received) -> None:
        kind, source, o = transfer.data_type, transfer.source, self._options
        if kind in (RAW_COMMAND, RPM_COMMAND):
            self._stay(f"node {source} commands ESCs as well: only one master may; end it, then {AGAIN}")
        elif source == o.own_node_id:
            self._stay(f"another node has own_node_id {source}: give one of them another identifier, then {AGAIN}")
        elif kind == STATUS and source != o.node_id and transfer.value.esc_index == o.esc_index:
            self._stay(
                f"node {source} says as well that it is ESC {o.esc_index}, and would turn with ours: give it another"
                f" esc_index, then {AGAIN}"
            )
        elif source == o.node_id and kind == NODE_STATUS:
            self._judge_state(transfer)
        elif source == o.node_id and kind == STATUS and transfer.value.esc_index == o.esc_index:
            self._judge_errors(int(transfer.value.error_count))

    def _stay(self, sentence: str) -> None:
        self._stays = self._stays or f"{self._name}: {sentence}"

    def _judge_state(self, transfer: Received) -> None:
        value, node = transfer.value, self._options.node_id
        if self._uptime is not None and value.uptime_sec < self._uptime:
            self._stay(
                f"node {node} was up for {self._uptime} s and is for {value.uptime_sec} s now: it has restarted, or two"
                f" nodes have that identifier; check its supply, then {AGAIN}"
            )
        self._uptime = int(value.uptime_sec)
        health, mode = int(value.health), int(value.mode)
        self._now = None
        if health >= ERROR:
            self._now = (
                f"{self._name} reports health {HEALTH[health]} (vendor status {value.vendor_specific_status_code}):"
                " clear its cause"
            )
        elif mode:
            self._now = f"{self._name} is {MODES.get(mode, f'in mode {mode}')} and not operational"

    def _judge_errors(self, count: int) -> None:
        if self._errors is not None and count > self._errors:
            self._stay(f"error_count went from {self._errors} to {count}: see what its maker means by it, then {AGAIN}")
        self._errors = count
