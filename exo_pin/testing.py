"""The consistency checks as pytest cases, for a user's own test files.

One line in a test file::

    from exo_pin.testing import consistency_checks

    test_my_design = consistency_checks("mine.toml")
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from os import PathLike

from .consistency import CHAIN_CHECKS, WRIST_CHECKS
from .core.optional_packages import optional
from .design import Mechanism
from .exo.loading import load
from .exo.shoulder_exo import ShoulderExo

pytest = optional("test", "pytest")

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
    given = load(source) if isinstance(source, str | PathLike) else source
    exo = given if isinstance(given, ShoulderExo) else ShoulderExo.from_device(given)
    closed_forms = () if exo.wrist is None or exo.wrist.beyond_record else WRIST_CHECKS
    report = cache(exo.check)

    @pytest.mark.parametrize("name", [*CHAIN_CHECKS, *closed_forms])
    def run(name: str) -> None:
        for finding in report().findings:
            assert finding.name != name or finding.outcome != "fail", f"{exo.name}: {name}: {finding.detail}"

    return run
