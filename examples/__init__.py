"""Studies made with vibrodrive, each a script that can be run: `python -m examples.three_questions`.

They are not installed: run them in the root of a clone.
"""
