"""Packages of the extras, looked for without importing them: before long work that would need them at its end."""

from __future__ import annotations

from importlib.util import find_spec

from .inputs import MissingExtra

_PACKAGES = {"plot": ("matplotlib",), "person": ("myo_sim", "mujoco", "clarabel"), "optimise": ("optuna", "cmaes")}


def require_extra(extra: str) -> None:
    """Check that the packages of an extra are there.

    Raises
    ------
    MissingExtra
        If one is not.
    """
    missing = [name for name in _PACKAGES[extra] if find_spec(name) is None]
    if missing:
        raise MissingExtra(extra, " and ".join(missing))
