"""Step responses of a hung mass."""
