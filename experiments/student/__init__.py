"""Policies beside the expert."""
