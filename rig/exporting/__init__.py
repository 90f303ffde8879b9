"""What the rig has made goes to other programs: a recording in, tables with units that they read out."""
