"""Files whose numbers are rounded: their digits, right angles that they round, and other numbers of the same digits."""
