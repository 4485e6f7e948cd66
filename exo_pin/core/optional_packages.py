"""Packages of the extras: the one doorway, which tells absent, broken and unsuitable ones apart."""

from __future__ import annotations

import sys
import warnings
from importlib import import_module
from typing import Any

from .errors import MissingExtra

#: Modules of the extras.
_MODULES = {
    "plot": ("matplotlib",),
    "person": ("myo_sim", "mujoco", "clarabel"),
    "optimise": ("optuna", "cmaes"),
    "robots": ("mujoco", "yaml"),
    "study": ("pandas", "openpyxl"),
    "recordings": ("ezc3d",),
    "report": ("fpdf", "matplotlib"),
    "app": ("nicegui",),
    "service": ("starlette", "uvicorn", "websockets", "prometheus_client"),
    "optimal-control": ("crocoddyl",),
    "gym": ("gymnasium",),
    "test": ("pytest",),
}
#: Versions whose compiled models are known: least, and the first that is not.
_VERSIONS = {("person", "mujoco"): ((3, 10), (4, 0)), ("robots", "mujoco"): ((3, 10), (5, 0))}
#: What modules are called where they are installed.
_NAMES = {"yaml": "PyYAML", "fpdf": "fpdf2", "contourpy": "matplotlib"}


def optional(extra: str, module: str) -> Any:
    """Import a module of an extra.

    Parameters
    ----------
    extra : str
    module : str
        Its full name, such as ``"matplotlib.pyplot"``.

    Returns
    -------
    module

    Raises
    ------
    MissingExtra
        If its package is absent, cannot be loaded, or has a version that is not known; ``problem`` says which.
    KeyboardInterrupt
        If Ctrl-C has come while it was loaded; many packages make another error of it.
    """
    top = module.partition(".")[0]
    package = _NAMES.get(top, top)
    try:
        found = _loaded(module)
    except Exception as error:
        if _is_interrupted(error):
            raise KeyboardInterrupt from error
        if isinstance(error, ModuleNotFoundError) and error.name == top:
            raise MissingExtra(extra, package) from error
        raise MissingExtra(extra, package, f"cannot be loaded: {error}") from error
    if (extra, top) in _VERSIONS:
        least, end = _VERSIONS[extra, top]
        if not least <= tuple(int(part) for part in found.__version__.split(".")[:2]) < end:
            known = f"{package}>={least[0]}.{least[1]},<{end[0]}"
            raise MissingExtra(extra, known, f"has version {found.__version__}")
    return found


def _loaded(module: str) -> Any:
    # Filters of warnings are those of all threads: they change only while a package is loaded for the first time.
    if module in sys.modules:
        return import_module(module)
    with warnings.catch_warnings():
        # Optuna's progress bar, which nobody sees here, asks for widgets in a notebook without.
        warnings.filterwarnings("ignore", message="IProgress not found")
        return import_module(module)


def require_extra(extra: str) -> None:
    """Load the packages of an extra: before long work that would need them at its end.

    Raises
    ------
    MissingExtra
        As :func:`optional`.
    """
    for module in _MODULES[extra]:
        optional(extra, module)


def _is_interrupted(error: BaseException | None) -> bool:
    """Whether Ctrl-C is among the causes of an error."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None
