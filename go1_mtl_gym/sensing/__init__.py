"""What is measured: the true state, the flat observation, and what a state estimator makes of it."""
