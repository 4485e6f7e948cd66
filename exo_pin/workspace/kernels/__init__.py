"""What a workspace is computed of, over stacks of poses, compiled."""
