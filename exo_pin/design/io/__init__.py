"""Mechanisms as TOML files."""
