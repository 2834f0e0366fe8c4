"""What people use today for this model, set up as each one's own users would, and tuned."""
