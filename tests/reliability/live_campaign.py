"""The campaign that is run against the simulated bench, to be filled in."""

CAMPAIGN = """
[campaign]
name = "reliability"
bench = "bench.toml"
thrusters = {thrusters}
output = "out"
unattended = {unattended}
expected_C = 0.5
prove_watchdog = {prove}

[tare]
duration = 1.0
max_std_error = 0.2
max_drift = 1.0

[plan]
kind = "levels"
voltages = [10.0, -10.0, 6.0, -6.0]
slew = 24.0
zero_every = 2
[plan.dwell]
kind = "fixed"
duration = {dwell}
"""
