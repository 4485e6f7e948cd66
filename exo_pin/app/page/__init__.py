"""Widgets of the page, and what they show."""
