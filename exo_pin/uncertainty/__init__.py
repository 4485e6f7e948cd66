"""Sensitivities, worst cases and rankings of the shoulder force."""
