"""Benchmarks of speed and accuracy, for vibrodrive and for other common methods. Each benchmark is one command."""
