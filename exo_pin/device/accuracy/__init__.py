"""How well drives place the arm: weakest rates of their positions, and poses that look alike to them."""
