"""Figures of runs: what they show (sheets), once, and drawn for print or handed on to a page."""
