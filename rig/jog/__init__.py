"""`rig jog`: a small voltage goes in, the controller process holds it while a key is held, a direction comes out.

It is a campaign of one hold like any other: same preflight, proof of the watchdog, guard and loop.
Nothing here commands.
"""
