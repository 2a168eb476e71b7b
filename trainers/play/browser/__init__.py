"""The player in browsers: viser serves the page, in which several tabs may see and drive the same robot."""
