"""Benchmarks of speed and accuracy, for vibrodrive and for other common methods. Each module with a `main` is one
command."""
