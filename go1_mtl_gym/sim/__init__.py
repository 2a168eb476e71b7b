"""The robot in MuJoCo, the parameters of its physics, and how they are drawn anew."""
