"""Environments to step, demonstrations collected in them, and batches of their rows."""
