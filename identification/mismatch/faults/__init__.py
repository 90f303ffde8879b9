"""From the channels of a recording to those that are wrong, and the recording with them put right."""
