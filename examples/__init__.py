"""Studies made with vibrodrive, each a script that can be run: `python -m examples.three_questions`."""
