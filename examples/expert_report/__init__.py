"""The sections of the expert's report card; `examples/report_expert.py` runs them."""
