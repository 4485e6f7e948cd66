"""A device in the scene: its links or limbs, cables and springs, and the forces that it draws."""
