"""Smoothing of samples, and the noise of their derivatives."""
