"""What of undetermined efforts and forces is made least, and which motions of a device are in balance."""
