"""Studies with vibrodrive. Each is a script: `python -m examples.three_questions`.

Examples are not installed. Run them in the root of a clone.
"""
