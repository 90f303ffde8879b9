"""What a recording says of its acquisition in; its channels on one clock, without delays and steps of a reading, out."""
