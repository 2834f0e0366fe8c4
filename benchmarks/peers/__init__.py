"""Other methods for this model. Each is set up as its usual users would do it, and tuned."""
