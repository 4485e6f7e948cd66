"""What the cuff puts on the arm: pull along it, slip, and pressure on the skin."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..core.conventions import along_arm
from ..core.errors import InvalidInput
from ..core.errors.base import echo
from ..core.validation import FloatArray

if TYPE_CHECKING:
    from .result import Reaction


def is_worn(self: Reaction) -> bool:
    """Whether the arm is a person's, so that a cuff is on it."""
    arm = self.source.poses.mechanism.arm
    return arm is not None and arm.person is not None


def cuff_pull(self: Reaction) -> FloatArray:
    """Force of the cuff on the arm along the arm, shape (...), N: positive towards the hand."""
    return along_arm(self.cuff_wrench[..., :3], _matrices(self))


def cuff_slip(self: Reaction) -> FloatArray | None:
    """Displacement and rotation vector of the cuff against the arm, shape (..., 6), m and rad, arm frame {O_B}.

    Of a split that takes the cuff as rigid, to first order, from the wrench on it. None where the design does not
    say how stiff its cuff is.
    """
    if self.interface_displacements is not None:
        return np.asarray(self.interface_displacements[..., 1, :])
    cuff = self.source.poses.mechanism.interfaces.cuff
    return None if cuff is None else cuff.slip(self.cuff_wrench, _matrices(self))


def cuff_pressure(self: Reaction) -> FloatArray | None:
    """Mean force over area of the cuff on the skin, shape (...), Pa; None where the area is not known.

    The force across the arm over :attr:`exo_pin.Interfaces.cuff_area`: a mean, where the pressure under a cuff has
    peaks. What the moment of the cuff adds on its two ends is not in it.
    """
    area = self.source.poses.mechanism.interfaces.cuff_area
    if area is None:
        return None
    force = np.linalg.norm(self.cuff_wrench[..., :3], axis=-1)
    return np.asarray(np.sqrt(np.maximum(force**2 - self.cuff_pull**2, 0.0)) / area)


def cuff_text(self: Reaction, index: tuple[int, ...] = ()) -> str:
    """Pull, slip and pressure of the cuff in words: in a pose of the stack, or the most of all held ones.

    Empty where it is not on a person's arm, or no pose has an answer.

    Parameters
    ----------
    index : tuple of int
        Of the pose in the stack; empty for a single pose or for all.

    Returns
    -------
    str

    Examples
    --------
    >>> exo = ep.load("four-cables-worn")
    >>> print(exo.reaction(exo.pose(45)).cuff_text().split(".")[0])
    The cuff pulls along the arm with 57 N, towards the shoulder
    """
    pulls, chosen = self.cuff_pull, np.zeros(self.status.shape, dtype=bool)
    try:
        chosen[index] = True
    except (IndexError, ValueError):
        raise InvalidInput(f"expected index of a pose of shape {chosen.shape}, got {echo(index)}") from None
    chosen &= np.isfinite(pulls) & (self.held | (chosen.sum() == 1))
    if not self.is_worn or not chosen.any():
        return ""
    most = "up to " if chosen.sum() > 1 else ""
    pull = float(max(pulls[chosen], key=abs))
    text = f"The cuff pulls along the arm with {most}{abs(pull):.0f} N"
    text += "" if abs(pull) < 0.5 else f", towards the {'shoulder' if pull < 0.0 else 'hand'}"
    if (slip := self.cuff_slip) is not None:
        moved, turned = (np.linalg.norm(part[chosen], axis=-1).max() for part in np.split(slip, 2, axis=-1))
        text += f"; by its stiffness it slips {most}{1e3 * moved:.1f} mm and turns {most}{np.degrees(turned):.1f}°"
    if (pressure := self.cuff_pressure) is not None:
        area = 1e4 * (self.source.poses.mechanism.interfaces.cuff_area or np.nan)
        mean = f"{most}{1e-3 * float(pressure[chosen].max()):.1f} kPa, on {area:.0f} cm²"
        text += f". Across the arm, its mean force over area on the skin is {mean}"
    return f"{text}."


def _matrices(self: Reaction) -> FloatArray:
    return self.source.poses.matrices.reshape(*self.status.shape, 3, 3)


def cuff_columns(self: Reaction) -> dict[str, FloatArray]:
    """Pull, slip and mean force over area of the cuff, of the stack's shape; what is not known is left out.

    Returns
    -------
    dict of str to ndarray
        With units in the names.

    Examples
    --------
    >>> exo = ep.load("four-linear-actuators-worn")
    >>> {name: float(values.round(1)) for name, values in exo.reaction(exo.pose(45)).cuff_columns().items()}
    {'cuff_pull_N': 12.3, 'cuff_pressure_Pa': 1339.7}
    """
    columns = {"cuff_pull_N": self.cuff_pull} if self.is_worn else {}
    if (slip := self.cuff_slip) is not None:
        columns["cuff_slip_m"] = np.linalg.norm(slip[..., :3], axis=-1)
    return columns | ({} if self.cuff_pressure is None else {"cuff_pressure_Pa": self.cuff_pressure})
