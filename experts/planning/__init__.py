"""Motion before forces: the nominal cycle, the body over the horizon, footholds, swinging feet."""
