"""Checks of the program against exact or published results. Each check gives numbers, their bounds and a verdict."""
