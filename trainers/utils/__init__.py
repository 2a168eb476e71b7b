"""Files that are complete or absent, logs and tables."""
