"""A production of thrusters that nobody has: made, fitted and watched as the commands of docs/howto/fleet.md do it."""
