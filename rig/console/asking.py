"""What the operator asks of the controller, and the lease that says that the screen is alive."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import replace

from textual.app import App

from rig.console.feed import Feed
from rig.console.parting import Parting
from rig.console.view_model.actions import device_gone
from rig.console.view_model.view import View
from rig.errors import LinkError
from rig.link.front_end_messages import Request, RequestKind


class AskingApp(App[None], inherit_bindings=False):
    """The part of the console that sends. Each request is on its way when its method returns."""

    def __init__(self, feed: Feed, clock: Callable[[], float], state: View) -> None:
        """`clock` gives s and never goes back; `state` is what is known so far."""
        super().__init__()
        self.feed = feed
        self.clock = clock
        self.state = state
        self.parting: Parting | None = None

    @abstractmethod
    def show_text(self) -> None:
        """Draw anew what has changed."""

    @property
    def ended(self) -> bool:
        """Nothing turns any more: the controller said so."""
        return self.state.snapshot is not None and self.state.snapshot.state == "done"

    def action_stop(self) -> None:
        """The stop key: the request goes out here, before anything is drawn."""
        try:
            self.feed.send(Request("stop", "console"))
            failed = ""
        except LinkError as error:
            failed = str(error)
        first = self.state.stop_asked
        self.state = replace(self.state, stop_asked=self.clock() if first is None else first, stop_failed=failed)
        self.call_later(self.show_text)

    def action_ask(self, kind: RequestKind, text: str = "") -> None:
        """Send a request that needs no answer; say so when it cannot be sent."""
        if self.only_looks_on():
            return
        try:
            self.feed.send(Request(kind, text))
        except LinkError as error:
            self.notify(str(error), title=f"{kind}: not sent", severity="error", markup=False)
            return
        self.notify(f"asked the controller: {kind} {text}", timeout=2.0, markup=False)

    def only_looks_on(self) -> bool:
        """Whether nothing may be asked from here; then that is said."""
        if self.state.looks_on:
            self.notify("This console looks on. Press l to attend.", severity="warning")
        return self.state.looks_on

    def action_take_lease(self) -> None:
        """From now on this console attends, beside the one that does."""
        if self.state.snapshot is not None and self.state.snapshot.replay:
            self.notify("A recording plays: there is nothing to attend.", severity="warning")
            return
        self.state = replace(self.state, looks_on=False)
        self.renew_lease()
        self.show_text()

    def action_go(self) -> None:
        """F5: start, or the thruster is mounted, whichever the controller waits for."""
        waits_for: dict[str, RequestKind] = {"preflight": "start", "mount": "mounted"}
        state = self.state.snapshot.state if self.state.snapshot is not None else ""
        if state in waits_for:
            self.action_ask(waits_for[state])
        else:
            self.notify("F5 starts a run; the controller waits for no start now.", severity="warning")

    def action_again(self) -> None:
        """R: in the preflight one device that is not there is tried once more, later a pause ends."""
        snapshot = self.state.snapshot
        gone = device_gone(snapshot) if snapshot is not None and snapshot.state == "preflight" else ""
        if gone:
            self.action_ask("retry", gone)
        else:
            self.action_ask("resume")

    def renew_lease(self) -> None:
        leaving = self.parting is not None and self.parting.kind == "detach"
        if self.state.connected and not leaving:
            try:
                self.feed.send(Request("watch" if self.state.looks_on else "lease"))
            except LinkError:
                return  # `receive` reports the end of the link, and the banner says so
