"""Compiled functions of the loops: residual, Jacobian, its rate, unit wrenches, and solutions of its rows."""
