"""Measurements behind the published results: ``python -m experiments list | run NAME | publish``; not installed."""
