"""From what a motor is told, its rotation, its current and the thrust to a sentence that says where they contradict.

Nothing in here holds a motor on, and nothing reads a clock. Order: `hold` makes means of a constant command, `jump`
compares those of one hold, `levels` those of several, `delay` looks at the way between two; `watch` asks them in turn.
"""
