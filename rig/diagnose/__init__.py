"""From recordings to what their model leaves out, as text, JSON, page, twin and plan: `rig diagnose`, `compare`."""
