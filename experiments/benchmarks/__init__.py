"""Times of the expert and of the training, next to others'."""
