"""The sections of the student's report; `examples/report_student.py` runs them."""
