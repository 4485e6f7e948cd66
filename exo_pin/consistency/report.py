"""Findings and reports of checks, and the check of closure Jacobians."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np
import pinocchio as pin

from ..chain import ClosedChain
from ..core.errors.checked import checked
from ..core.results import Result
from ..core.tables import html_table
from ..core.validation import FloatArray

Outcome = Literal["pass", "note", "fail"]

#: Poses checked around the first one, seeded.
POSES = 12
#: Loop residual, m and rad.
CLOSED = 1e-12
#: What the digits of a rounded geometry leave open at most, in tolerances.
_FEW = 20.0
#: Step of central differences: their truncation and rounding errors are equal there.
STEP = float(np.finfo(float).eps ** (1 / 3))
#: Largest error of a Jacobian that such a step explains, for second derivatives of the Jacobian up to about 500.
JACOBIAN = 500 * STEP**2


@checked
@dataclass(frozen=True)
class Finding:
    """Result of one check: its name, whether it passed, and its evidence in a sentence.

    Examples
    --------
    >>> found = ep.load("prototype").check().findings[-2]
    >>> found.name, found.outcome
    ('wrist conditions', 'pass')

    Attributes
    ----------
    name : str
        Of the check.
    outcome : {"pass", "note", "fail"}
        How it ended.
    detail : str
        What was found.
    """

    name: str
    outcome: Outcome
    detail: str

    @classmethod
    def of(cls, name: str, passed: bool, detail: str) -> Finding:
        """A check that passed, or failed.

        Parameters
        ----------
        name : str
            Of the check.
        passed : bool
            Whether it passed.
        detail : str
            What was found.

        Returns
        -------
        Finding

        Examples
        --------
        >>> from exo_pin.consistency import Finding
        >>> Finding.of("loops", 2e-9 < 1e-12, "residual 2e-9 m").outcome
        'fail'
        """
        return cls(name, "pass" if passed else "fail", detail)


@dataclass(frozen=True)
class Report(Result):
    """All findings about a mechanism; prints as a table.

    Attributes
    ----------
    mechanism : str
        Its name.
    findings : tuple of Finding
        One a check.

    Examples
    --------
    >>> report = ep.load("scenario-one").check()
    >>> report.passed, [finding.name for finding in report.findings if finding.outcome == "note"]
    (True, ['mobility', 'inertia', 'neutral pose'])
    """

    mechanism: str
    findings: tuple[Finding, ...]

    @property
    def passed(self) -> bool:
        """Whether nothing failed."""
        return all(finding.outcome != "fail" for finding in self.findings)

    def _head(self) -> str:
        return f"{self.mechanism}: {'consistent' if self.passed else 'NOT CONSISTENT'}"

    def __str__(self) -> str:
        width = max(len(finding.name) for finding in self.findings)
        lines = [f"  {item.outcome:4}  {item.name:{width}}  {item.detail}" for item in self.findings]
        return "\n".join([self._head(), *lines])

    def _repr_html_(self) -> str:
        """What a notebook shows."""
        rows = [(item.name, item.outcome, item.detail) for item in self.findings]
        return html_table(("check", "outcome", "evidence"), rows, [self._head()], numbers=False)


def closure_jacobian(chain: ClosedChain, configurations: Iterable[FloatArray]) -> Finding:
    """The closures' Jacobian against central differences on the chain's manifold."""
    if not chain.closures:
        return Finding("closure Jacobian", "note", "the chain has no loops")
    worst = np.max([_jacobian_error(chain, q) for q in configurations])
    # Of open loops the rate of a rotation vector is not the angular velocity.
    most = JACOBIAN + opening_of(chain)
    return Finding.of("closure Jacobian", worst <= most, f"differences deviate by {worst:.1e}")


def opening_of(chain: ClosedChain) -> float:
    """How far closed loops may be open by the digits of their geometry, m and rad; 0 for an exact one."""
    return _FEW * chain.description.tolerance * max(1.0, 1.0 / chain.characteristic_length)


def _jacobian_error(chain: ClosedChain, q: FloatArray) -> float:
    """Largest difference between the closures' Jacobian and central differences."""
    J, worst = chain.constraint_jacobian(q), 0.0
    for column in range(chain.model.nv):
        step = np.zeros(chain.model.nv)
        step[column] = STEP
        ahead, behind = (chain.residual(pin.integrate(chain.model, q, sign * step)) for sign in (1.0, -1.0))
        worst = np.maximum(worst, np.abs(J[:, column] - (ahead - behind) / (2 * STEP)).max())
    return float(worst)
