"""The tables of arXiv 2505.08574, reproduced."""
