"""What a file says otherwise than the chain that it was written from."""
