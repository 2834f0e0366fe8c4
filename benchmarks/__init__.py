"""Benchmarks: speed charted against accuracy, ours and what people use. One command each."""
