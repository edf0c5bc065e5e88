"""Hostile, broken and slightly wrong files: each must end in success or in one of the package's own errors.

`scripts/fuzz.py` runs as many inputs as asked, `tests/test_fuzz.py` a short form and every fault found so far. An
input is made of the seed of the run and its own number alone, so that any of them can be made again.
"""
