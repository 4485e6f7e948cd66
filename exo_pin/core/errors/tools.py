"""Errors of solvers and of other programs."""

from __future__ import annotations

from collections.abc import Iterable

from .base import ExoPinError


class BrowserNotFound(ExoPinError, RuntimeError):
    """A still picture needs a browser that draws without a screen, and there is none.

    Attributes
    ----------
    programs : tuple of str
        The programs that were searched for.
    """

    def __init__(self, programs: Iterable[str], variable: str) -> None:
        self.programs = tuple(programs)
        super().__init__(
            f"a still picture needs a headless browser, and none of these is installed: {', '.join(self.programs)}. "
            f"Install one (Debian: chromium) or name it in {variable}; save_html and --html need none"
        )


class BrowserFailed(ExoPinError, RuntimeError):
    """A browser did not draw a scene.

    Attributes
    ----------
    program : str
        The browser.
    """

    def __init__(self, program: str, reason: str) -> None:
        self.program = program
        super().__init__(f"{program}: {reason}")


class SolverFailed(ExoPinError, RuntimeError):
    """A numerical solver did not reach its accuracy.

    Attributes
    ----------
    solver : str
        Name of the solver.
    residual : float
        The residual it stopped at.

    Examples
    --------
    >>> exo = ep.load("prototype")
    >>> try:
    ...     exo.uncertainty(exo.pose(abduction=90))  # plates parallel: singular
    ... except ep.SolverFailed as error:
    ...     print(error.solver, error.residual)
    uncertainty inf
    """

    def __init__(self, solver: str, residual: float, detail: str = "") -> None:
        self.solver, self.residual = solver, float(residual)
        tail = f": {detail}" if detail else ""
        super().__init__(f"{solver} stopped at residual {self.residual:.3e}{tail}")
