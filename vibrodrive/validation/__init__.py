"""Checks of the program against exact or published results, each with a number, its bound and a verdict."""
