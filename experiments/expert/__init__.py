"""The expert alone, gait by gait."""
