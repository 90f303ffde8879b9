"""From messages to bytes between the processes and back: sockets, what crosses them, which runs are alive."""
