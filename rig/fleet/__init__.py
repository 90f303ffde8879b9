"""One question asked of every file of a fleet: rows that are kept, and never computed twice."""
