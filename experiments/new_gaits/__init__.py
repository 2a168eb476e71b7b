"""New gaits for a trained policy."""
