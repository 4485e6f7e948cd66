"""A device that follows the arm along a turn: rates of its joints, and verified steps, compiled."""
