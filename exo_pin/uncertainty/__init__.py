"""How sure a shoulder force is: what is uncertain of a device and its fit, and how much that changes the answer."""
