"""The parts of the report on new gaits; `examples/new_gaits.py` runs it."""
