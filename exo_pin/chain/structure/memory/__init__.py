"""One thread's scratch memory for a chain: Pinocchio's Data, windows on it, and buffers."""
