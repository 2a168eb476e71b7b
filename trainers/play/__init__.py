"""Driving a policy or the expert: sessions, keys, gamepads, windows, recordings."""
