"""Closed loop and one-step error: what a policy is measured by, and how it looks."""
