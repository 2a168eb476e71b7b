"""Studies of the space of gaits: how far the expert goes in it, and what a student makes of gaits it never saw."""
