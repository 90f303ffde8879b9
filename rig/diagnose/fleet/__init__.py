"""`rig diagnose FILES --jobs N`: a diagnosis of every recording by itself, as rows of a table."""
