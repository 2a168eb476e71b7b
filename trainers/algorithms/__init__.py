"""Behavior cloning, DAgger and what else trains a policy."""
