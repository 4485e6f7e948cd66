"""Commands about the wearer."""
