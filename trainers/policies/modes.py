"""How inputs and outputs of a network can be normalized; to be read without PyTorch."""

MODES = ("mean_std", "min_max", "none")
"""To mean 0 and standard deviation 1, to [-1, 1], or not at all."""
