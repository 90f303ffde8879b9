"""What each stage of a diagnosis handed on in; the account of it that `rig diagnose --explain` prints out."""
