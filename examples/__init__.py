"""Studies with vibrodrive. Each module is a script, for example `python -m examples.three_questions`.

Examples are not installed. Run them in the root of a clone.
"""
