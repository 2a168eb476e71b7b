"""What `examples/publish_results.py` writes, and from what."""
