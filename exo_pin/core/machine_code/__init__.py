"""Machine code of kernels, made by Numba: imported only where a kernel runs compiled."""
