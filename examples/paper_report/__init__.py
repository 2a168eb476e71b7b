"""The tables of arXiv 2505.08574, reproduced; `examples/reproduce_paper.py` makes them."""
