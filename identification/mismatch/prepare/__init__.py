"""From a recording to its history on intervals, with the channels that every run has."""
