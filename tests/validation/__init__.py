"""What the software is held to: every section measures something and compares it with a reference of others.

`scripts/validate.py` runs them all in full and writes `tests/VALIDATION.md`; `tests/test_validation.py` runs their
short form. A new section is a function that yields rows, and one entry in :mod:`validation.sections`.
"""
