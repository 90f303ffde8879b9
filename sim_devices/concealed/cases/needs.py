"""Effects that show only where the run gives them occasion: a flow, a drift, commands that slew."""

from __future__ import annotations

NEEDS_FLOW = frozenset({"speed_of_advance", "strut_drag", "reversed_flow_loss", "crossed_flow_loss"})
NEEDS_REVERSED_FLOW = frozenset({"reversed_flow_loss"})
NEEDS_ROTATION = frozenset({"rotation_coupling"})
NEEDS_SLEW = frozenset({"motor_lag", "time_skew", "stand_resonance"})
"""Where steps come at once a millisecond of these is plain to see: they would never be faint."""
NEEDS_DRIFT = frozenset({"temperature_squared"})
