"""The page on which a stranger drives the robot in a browser; here is what Python writes for it. Not installed."""
