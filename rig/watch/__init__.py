"""From the rows of a running recording to mismatches: the watcher process and the controller's side of it."""
