"""Figures and claims of the paper, recomputed: `python -m benchmarks.paper`. README.md contains the result.

These modules use the public functions of vibrodrive and the few other names that tests/benchmarks/test_paper.py lists.
"""
