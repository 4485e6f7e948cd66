"""What a design is made of, on the command line."""
