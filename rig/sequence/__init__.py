"""From a plan and what a tick has seen to the next command, points and steps: the sequencer, in virtual time."""
