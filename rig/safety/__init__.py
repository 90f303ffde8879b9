"""From readings, times and counts to what may stop a motor: trips, watchdog proof, measured rest. Pure."""
