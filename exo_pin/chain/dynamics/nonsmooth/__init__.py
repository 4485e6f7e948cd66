"""Dry friction in joints and joint limits as stops: forces that are a set at rest, impacts, and their events."""
