"""The consistency checks as pytest cases, for a user's own test files.

One line in a test file::

    from exo_pin.testing import consistency_checks

    test_my_design = consistency_checks("mine.toml")
"""

from __future__ import annotations

from collections.abc import Callable
from os import PathLike

from .consistency import CHECKS, run_check
from .design import Mechanism
from .errors import MissingExtra
from .exo import ShoulderExo, load

try:
    import pytest
except ImportError as error:
    raise MissingExtra("test", "pytest") from error

__all__ = ["consistency_checks"]


def consistency_checks(source: str | PathLike[str] | ShoulderExo | Mechanism) -> Callable[[str], None]:
    """Make a pytest function that runs every consistency check as a case of its own.

    Parameters
    ----------
    source : str, path-like, ShoulderExo or Mechanism
        What :func:`exo_pin.load` loads, or a design.

    Returns
    -------
    callable
        To be bound to a name that starts with ``test_``.
    """
    if isinstance(source, Mechanism):
        mechanism = source
    else:
        mechanism = (source if isinstance(source, ShoulderExo) else load(source)).mechanism

    @pytest.mark.parametrize("name", CHECKS)
    def run(name: str) -> None:
        finding = run_check(name, mechanism)
        assert finding.outcome != "fail", f"{mechanism.name}: {finding.name}: {finding.detail}"

    return run
