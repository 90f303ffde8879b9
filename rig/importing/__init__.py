"""From tables and logs of other programs to recordings, by a map that states every assumption: `rig import`."""
