"""Structure of a closed chain: its state object, closures, arrays for the kernels, memory of a thread."""
