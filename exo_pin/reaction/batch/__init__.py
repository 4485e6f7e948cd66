"""Reactions over millions of poses, compiled."""
