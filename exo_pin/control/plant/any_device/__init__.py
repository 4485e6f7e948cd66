"""The plant of any device, as its closed chain; a wrist in closed form needs none of it."""
