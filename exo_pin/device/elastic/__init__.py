"""Equilibrium of devices that give way at the harness, the cuff and in their own links."""
