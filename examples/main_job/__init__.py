"""The main job's settings, students and pictures; `examples/dagger.py` runs it."""
