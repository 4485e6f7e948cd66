"""Equations of the plant, compiled: muscles, air, stops, arm; their integration; and the tables that they read."""
