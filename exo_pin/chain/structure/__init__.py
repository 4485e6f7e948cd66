"""What a closed chain consists of: tree, closures, arrays for the kernels, memory of a thread."""
