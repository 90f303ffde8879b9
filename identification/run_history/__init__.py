"""One run as the engine sees it: means over intervals, and what memory, ticks and splines make of them."""
