"""Machine code of the kernels, in wheels that contain it (`jit/shipped.py` loads it)."""
