"""What a recording says of its acquisition in; channels on one clock, without delays and steps of a reading, out."""
