"""A desk-top bench: a world file goes in; ports for the rig, a port of control and a log of the truth come out."""
