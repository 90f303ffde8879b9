"""What a kind of device contributes to `rig devices`: what it says by itself, and questions that move and set nothing.

A probe is pure but for the line or bus that it is handed. It never sends a set-point, never writes a setting, and never
an end of line alone: that would carry out half a command which somebody left in the device's buffer.
"""
