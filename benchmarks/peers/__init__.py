"""Other methods for this model, each set up as its own users would, and tuned."""
