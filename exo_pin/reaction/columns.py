"""Reactions as columns of a table, with units in the names, as plain data, and as pictures."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..core.results import drawn
from ..core.validation import FloatArray
from ..design.shoulder import PRESSURE_LIMITS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from .batch.reaction_maps import ReactionMap
    from .result import Reaction

#: What an answer as plain data has besides its fields: properties, evidence of infeasibility, parts of the certificate.
_DERIVED = (
    "verdict",
    "magnitude",
    "percent_body_weight",
    "harness_wrench",
    "ratio",
    "can_hold",
    "unknown",
    "status",
    "reasons",
    "clearance",
    "cuff_pull",
    "cuff_slip",
    "cuff_pressure",
)
_EVIDENCE = ("closest_actuator_forces", "missing_wrench", "blocking", "relief")
_DETERMINED = ("actuator_forces", "constraint_forces", "shoulder_force", "torso_wrench")


def vector_columns(label: str, values: FloatArray | None, names: Any) -> dict[str, FloatArray]:
    """Columns of the last axis of an array, none for None; ``label`` has a place for the name."""
    return {} if values is None else {label.format(name): values[..., k] for k, name in enumerate(names)}


def force_columns(answer: Reaction | ReactionMap) -> dict[str, FloatArray]:
    """F_s, |F_s|, f, g and the margin, N and 1, each of the stack's shape; without what a map left out."""
    f, g = answer.actuator_forces, answer.constraint_forces
    limbs = range(1, 1 + (f if f is not None else g if g is not None else np.empty((0,))).shape[-1])
    columns = vector_columns("F_s_{}_N", answer.shoulder_force, "xyz")
    columns |= {} if answer.magnitude is None else {"F_s_N": answer.magnitude}
    if drives := getattr(answer, "drive_units", ()):
        columns |= vector_columns("{}", f, [f"{name}_{unit.replace(' ', '_')}" for name, unit in drives])
    else:
        columns |= vector_columns("f_{}_N", f, limbs)
    columns |= vector_columns("g_{}_N", g, limbs)
    return columns | ({} if answer.margin is None else {"margin": answer.margin})


def peak_of(magnitude: FloatArray) -> float:
    """Largest of the finite values; NaN if there is none."""
    known = magnitude[np.isfinite(magnitude)]
    return float(known.max()) if known.size else float("nan")


def peak(self: Reaction) -> float:
    """Largest |F_s| of all poses that can be held as far as limits are known, N; NaN if there is none."""
    return peak_of(self.magnitude[self.held])


def drive_units(self: Reaction) -> tuple[tuple[str, str], ...]:
    """Name and unit of each effort of a device that is not a wrist; empty of limbs, whose tensions are in N."""
    return self.source.poses.mechanism.drive_units


def clearance(self: Reaction) -> FloatArray:
    """Least gap of the device's parts to the wearer and to one another, shape (...), m; negative in an overlap.

    That of the criterion "clearance" of a workspace. NaN where it is not known who wears the design or how thick
    its parts are (:attr:`cautions` say which), and where the device does not reach the pose. Of limbs that give way
    the undisplaced ones.
    """
    return np.asarray(self.source.poses.gaps.least.min(axis=1).reshape(self.status.shape))


def crossings(self: Reaction) -> NDArray[np.int64]:
    """Where a path crosses the singular surface.

    Returns
    -------
    ndarray of int
        Shape (k, d) for a stack of d dimensions, the last of which runs along the path: index of the last pose
        before det X takes the other sign. Poses on the surface itself belong to neither side: a path that steps
        onto it and goes on crosses once, one that touches it and turns back does not. Empty for other than three
        limbs, whose surface has no such sign.

    Notes
    -----
    A path to a pose beyond the surface passes a pose in which the limbs cannot hold the arm.

    Examples
    --------
    >>> exo = ep.load("prototype")
    >>> path = exo.pose(abduction=np.arange(0.0, 11.0))  # det X = 0 at 6.21°
    >>> exo.reaction(path, limits="none").crossings().tolist()
    [[6]]
    """
    # Poses that the limbs are too weak for lie on one side of the surface, too.
    side = np.where(self.equilibrium_status == "singular", 0.0, np.sign(np.nan_to_num(self.determinant)))
    if side.ndim == 0:
        return np.empty((0, 0), dtype=np.int64)
    found = []
    for path in np.ndindex(side.shape[:-1]):
        steps = np.flatnonzero(side[path])
        signs = side[path][steps]
        found += [(*path, int(steps[k])) for k in np.flatnonzero(signs[1:] != signs[:-1])]
    return np.array(found, dtype=np.int64).reshape(len(found), side.ndim)


def columns(self: Reaction) -> dict[str, Any]:
    """Forces, margin, det X and status of every pose, with units in the names; NaN where there is no answer.

    Where the data of a part do not cover a pose of the stack, the column "reason" says which.

    Returns
    -------
    dict of str to ndarray
        Each of the stack's shape.

    Examples
    --------
    >>> exo = ep.load("four-cables")
    >>> list(exo.reaction(exo.pose([0, 45])).columns())[:4]
    ['F_s_x_N', 'F_s_y_N', 'F_s_z_N', 'F_s_N']
    """
    return (
        force_columns(self)
        | self.cuff_columns()
        | {"det_X": self.determinant, "status": self.status.astype(object)}
        | ({"reason": self.reasons.astype(object)} if self.reasons.any() else {})
    )


def plot(
    self: Reaction,
    along: ArrayLike | None = None,
    label: str = "pose",
    limits: tuple[ArrayLike, ArrayLike] | None = None,
) -> Figure:
    """Draw a pose as bars, poses along one dimension as curves.

    Parameters
    ----------
    along : array_like, optional
        Shape (k,), of a stack: values of the horizontal axis; the poses' numbers if left out.
    label : str
        Name of these values with the unit, such as "flexion, °".
    limits : (lower, upper), optional
        N, tension positive, each broadcasting to the limb forces: what the actuators can give.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InvalidInput
        If the stack has more than one dimension, or shapes do not fit.
    MissingExtra
        If matplotlib is not installed.

    Examples
    --------
    >>> exo, angles = ep.load("four-linear-actuators"), np.array([0.0, 40.0, 80.0])
    >>> figure = exo.reaction(exo.pose(angles)).plot(along=angles, label="flexion, °")
    >>> len(figure.axes[0].lines) > 0
    True
    """
    return drawn("answer_plots:reaction_figure", self, along, label, limits)


def as_dict(self: Reaction) -> dict[str, Any]:
    """All fields as arrays and plain values, in one flat dict; of a single pose with its range of |F_s|.

    Returns
    -------
    dict
        By name of the field or property.

    Examples
    --------
    >>> exo = ep.load("four-linear-actuators-worn")
    >>> fields = exo.reaction(exo.pose(90)).as_dict()
    >>> round(float(np.linalg.norm(fields["shoulder_force"]) - fields["magnitude"]), 9)
    0.0
    """
    names = [field.name for field in fields(self) if field.name not in ("source", "case", "assumptions")]
    found = {name: getattr(self, name) for name in (*_DERIVED, *names)}
    found |= vars(self.optimum) | {"criterion": self.criterion, "cautions": list(self.cautions)}
    found |= {} if self.cuff_pressure is None else {"cuff_pressure_limits": PRESSURE_LIMITS}
    if self.status.ndim == 0 and (allowed := self.range()) is not None:
        # JSON has no infinity: unbounded is a word of its own.
        found |= {f"range_{name}": value for name, value in vars(allowed).items()}
        found["range_unbounded"] = bool(np.isinf(allowed.greatest))
    if self.infeasibility is not None:
        found |= {name: getattr(self.infeasibility, name) for name in _EVIDENCE}
    found |= {f"{name}_determined": getattr(self.certificate, name) for name in _DETERMINED}
    return found | {"undetermined": self.certificate.undetermined, "certificate": str(self.certificate)}
