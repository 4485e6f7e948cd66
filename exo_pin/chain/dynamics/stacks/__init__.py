"""Forces of many samples at once: certificates of their wrenches, and the stack of their answers."""
