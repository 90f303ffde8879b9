"""A bench to measure that needs no hardware: one world, the device side of each wire, and a log of the truth.

Written apart from the drivers and the identification on purpose: it shares no codec and no model with them.
"""
