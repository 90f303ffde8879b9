"""From the files of a folder to the entries that they make, each file read as what a stranger made."""
