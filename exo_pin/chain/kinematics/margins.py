"""Margins of a pose to a singularity: the worst ratios between efforts and travel of output and actuators."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from ...core.records import Record
from ...core.validation import FloatArray
from ..structure.chain_state import ChainState
from .loops import tree_frame_jacobian

#: An output frame, and the rows of its twist that count.
Output = tuple[str, slice]
#: Parts of a frame's pose that can be the output, as rows of its twist.
PARTS_OF_POSE = {"pose": slice(0, 6), "position": slice(0, 3), "orientation": slice(3, 6)}
#: A share of a motion below this is rounding.
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class Margins(Record):
    """Worst-case ratios between output and actuators at a pose. They grow without bound towards a singularity.

    Attributes
    ----------
    frame : str
        The output; loads are about its origin.
    effort : mapping of str to float
        Greatest norm of the actuators' efforts per load on the output, by unit: "N per N", "N per N m", "N m per N",
        "N m per N m", efforts of slides first. As many of them as there are kinds of actuators. Infinite in an output
        singularity.
    travel : mapping of str to float
        Greatest norm of the actuators' travel per travel of the output, by unit: "m per m", "m per rad", "rad per m",
        "rad per rad". Infinite in an input singularity.

    Examples
    --------
    >>> exo = ep.load("three-linear-actuators")
    >>> margins = exo.chain.mobility(exo.chain.close(exo.chain.neutral())).margins
    >>> weakest = np.linalg.svd(exo.jacobian(exo.pose()))[1][-1]  # m/rad
    >>> round(margins.effort["N per N m"] * float(weakest), 9)
    1.0
    """

    frame: str
    effort: Mapping[str, float]
    travel: Mapping[str, float]

    def __str__(self) -> str:
        return "\n".join(
            [
                f"effort per load      {_listed(self.effort)} on {self.frame}",
                f"actuator travel      {_listed(self.travel)} of {self.frame}",
            ]
        )


def _listed(ratios: Mapping[str, float]) -> str:
    return ", ".join(f"{_shown(value)} {unit}" for unit, value in ratios.items())


def _shown(value: float) -> str:
    """Four digits; 0 for rounding."""
    return "0" if abs(value) < _ROUNDING else f"{value:.4g}"


def margins(
    state: ChainState,
    q: FloatArray,
    null_space: FloatArray,
    driven: np.ndarray,
    output: Output,
    lost: tuple[int, int, int],
) -> Margins:
    """Margins of a pose.

    Parameters
    ----------
    state : ChainState
        The chain.
    q : ndarray
        Shape (nq,), closed.
    null_space : ndarray
        Shape (nv, dof), orthonormal motions that the constraints leave, coordinates in metres divided by the
        characteristic length.
    driven : ndarray of int
        Actuated coordinates.
    output : tuple of str and slice
        The output's frame, and the rows of its twist that are the output.
    lost : tuple of int
        Number of motions of the output with locked actuators, of the actuators with a locked output, and of neither.
        They determine the ranks here.
    """
    output_lost, input_lost, idle = lost
    dof = null_space.shape[1]
    # Ranks of the motions as the actuators see them, and as the output does.
    driving, following = dof - output_lost - idle, dof - input_lost - idle
    top = state.topology
    scale = top.column
    frame, counted = output
    tree = tree_frame_jacobian(state, q, frame)
    tree[np.setdiff1d(np.arange(6), np.arange(6)[counted])] = 0.0
    out = tree @ (scale[:, None] * null_space)
    drive = null_space[driven]
    slides = top.metres[driven]
    # The output's motion per actuator motion; efforts per load are its transpose, by virtual work.
    gain = out @ _inverse(drive, driving) / scale[driven]
    weights = np.repeat([top.length, 1.0], 3)
    seen = out / weights[:, None]
    back = scale[driven, None] * (drive @ _inverse(seen, following)) / weights
    held_out = free_in = False, False
    if output_lost:
        held_out = _moved(seen, drive, driving, np.arange(6) < 3)
    if input_lost:
        free_in = _moved(drive, seen, following, slides)
    effort, travel = dict[str, float](), dict[str, float]()
    for which, force, length, loose in ((slides, "N", "m", free_in[0]), (~slides, "N m", "rad", free_in[1])):
        parts = ((slice(0, 3), "N", "m", held_out[0]), (slice(3, 6), "N m", "rad", held_out[1]))
        for part, load, travelled, unheld in parts:
            if which.any() and counted.start <= part.start < counted.stop:
                effort[f"{force} per {load}"] = np.inf if unheld else _norm(gain[part][:, which])
                travel[f"{length} per {travelled}"] = np.inf if loose else _norm(back[which][:, part])
    return Margins(frame, MappingProxyType(effort), MappingProxyType(travel))


def _norm(matrix: FloatArray) -> float:
    return float(np.linalg.norm(matrix, 2)) if matrix.size else 0.0


def _inverse(matrix: FloatArray, rank: int) -> FloatArray:
    """Pseudo-inverse of a matrix whose rank is known: small singular values up to that rank are inverted."""
    U, values, Vt = np.linalg.svd(matrix, full_matrices=False)
    significant = np.maximum(values[:rank], np.finfo(float).tiny)
    return np.asarray((Vt[:rank].T / significant) @ U[:, :rank].T)


def _moved(moving: FloatArray, still: FloatArray, rank: int, first: np.ndarray) -> tuple[bool, bool]:
    """Whether motions that leave ``still`` at rest move the first and the other rows of ``moving``."""
    _, _, Vt = np.linalg.svd(still)
    left = moving @ Vt[rank:].T
    return _norm(left[first]) > _ROUNDING, _norm(left[~first]) > _ROUNDING
