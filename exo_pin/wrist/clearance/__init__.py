"""How near limbs come to the wearer and to one another."""
