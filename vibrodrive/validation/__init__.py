"""What is known exactly, or published, recomputed by the program: each with number, bound and verdict."""
