"""From bytes of a file to numbers of its good rows: what it is, its lines and cells, which rows are wanted."""
