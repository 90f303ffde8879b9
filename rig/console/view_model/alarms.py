"""The line that shouts: what the operator must know before anything else. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from rig.console.view_model.running_fit import running_fit
from rig.console.view_model.view import View
from rig.console.view_model.wording import age, clock
from rig.link.attention import wanted_for
from rig.link.front_end_messages import Snapshot

Severity = Literal["none", "info", "warning", "danger"]


@dataclass(frozen=True, slots=True)
class Alarm:
    """One sentence for the whole width of the screen."""

    severity: Severity = "none"
    text: str = ""


def alarm(view: View) -> Alarm:
    """The most urgent thing there is to say; `none` when all is well."""
    snapshot = view.snapshot
    if snapshot is not None and snapshot.stop_confirmed is False:
        return Alarm("danger", f"STOP NOT CONFIRMED — {_rotation(snapshot)}. Cut the power: hardware emergency stop.")
    if not view.connected:
        return _disconnected(view)
    if view.stop_failed:
        return Alarm("danger", f"STOP NOT SENT — {view.stop_failed}. Cut the power: hardware emergency stop.")
    if view.condition == "stale":
        sent = f"STOP SENT {age(view.now - view.stop_asked)} ago, no answer. " if view.stop_asked is not None else ""
        return Alarm("danger", f"{sent}NO FRESH DATA for {age(view.silence)} — the figures below are not the present.")
    if snapshot is None:
        return Alarm("info", "Waiting for the controller's first snapshot.")
    return _running(view, snapshot)


def call(view: View) -> str:
    """What an operator who looks elsewhere must hear of; empty: nothing."""
    if alarm(view).severity == "danger":
        return "danger"
    return wanted_for(view.snapshot) if view.snapshot is not None else ""


def _rotation(snapshot: Snapshot) -> str:
    for reading in snapshot.readings:
        if reading.quantity == "rotation_rate" and reading.value is not None:
            return f"the propeller was last measured at {reading.value:.2f} {reading.unit}"
    return "nothing measured says that the propeller is at rest"


def _disconnected(view: View) -> Alarm:
    last = f"figures are {age(view.silence)} old" if view.snapshot is not None else "no data ever came"
    if view.snapshot is not None and view.snapshot.state == "done":
        return _ended(view, view.snapshot)
    return Alarm(
        "danger",
        f"DISCONNECTED — the controller is gone; {last}. {_unsure(view)}"
        "The motor's own watchdog stops it; look at the propeller.",
    )


def _unsure(view: View) -> str:
    if view.stop_failed:
        return "Your STOP reached nobody. "
    confirmed = view.snapshot is not None and view.snapshot.stop_confirmed
    return "Your STOP was not confirmed. " if view.stop_asked is not None and not confirmed else ""


def _running(view: View, snapshot: Snapshot) -> Alarm:
    if view.stop_asked is not None and snapshot.state not in ("stopping", "done"):
        return Alarm(
            "warning", f"STOP SENT {age(view.now - view.stop_asked)} ago — the controller has not answered yet."
        )
    if snapshot.state == "stopping" and snapshot.stop_confirmed is None:
        after = f", {_after_key(view)}" if view.zero_after is not None else ""
        return Alarm("warning", f"STOPPING — command is 0 V{after}; waiting until the measured rotation is at rest.")
    if snapshot.state == "done":
        return _ended(view, snapshot)
    if snapshot.state == "mount" and snapshot.mounted_by_hand:
        return Alarm("warning", f"Put {snapshot.thruster} on the bench, then press F5. The motor turns after that.")
    if snapshot.state == "paused":
        return Alarm("warning", _paused(snapshot))
    wrong = [f"{r.channel} {r.state.upper()}" for r in snapshot.readings if r.state in ("stale", "limit")]
    if wrong:
        return Alarm("warning", "CHECK: " + ", ".join(wrong))
    return Alarm("info", f"WAITING at 0 V — {snapshot.reason}. k goes on now.") if snapshot.state == "wait" else Alarm()


def _paused(snapshot: Snapshot) -> str:
    why = f", {snapshot.reason}" if snapshot.reason else ""
    return f"PAUSED at 0 V for {clock(snapshot.state_elapsed)}{why} — press r to resume; the step is taken again."


def _after_key(view: View) -> str:
    """How long the stop took, as measured from the key to the snapshot that said 0 V."""
    return f"{1000 * (view.zero_after or 0.0):.0f} ms after your key"


def _ended(view: View, snapshot: Snapshot) -> Alarm:
    rest = f" 0 V {_after_key(view)}." if view.zero_after is not None else ""
    rest += " Propeller measured at rest." if snapshot.stop_confirmed else ""
    if snapshot.outcome == "completed":
        wrong = _misfit(snapshot)
        return Alarm("warning" if wrong else "info", f"COMPLETED.{rest}{wrong} Press d to leave.")
    how, why = snapshot.outcome.upper() or "ENDED", snapshot.cause.rstrip(".")
    return Alarm("warning", f"{how} — {why}.{rest} Press d to leave.")


def _misfit(snapshot: Snapshot) -> str:
    """What to know of the last thruster before its constant is copied from the screen."""
    fit = running_fit(snapshot.points)
    if fit is None or fit.misfit is None:
        return ""
    return f" {snapshot.thruster}: C V|V| does NOT fit (chi2/dof {fit.misfit:.3g}); next: rig diagnose."
