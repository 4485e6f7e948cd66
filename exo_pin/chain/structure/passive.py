"""Springs, damping and dry friction in the joints of a chain: forces, their derivatives, energy.

* Damping, from ``model.damping``: -d v for every coordinate, N s/m and N m s/rad.
* Springs, from :class:`exo_pin.chain.JointProperties`: -k times the difference that takes the reference to q, the
  gradient of k |difference|² / 2. Hinges, slides and every joint whose v is the rate of q: the coordinates. Spherical
  joints: the rotation vector, which jumps at half a turn. Free flights: the displacement in world axes and the
  rotation vector.
* Dry friction, from ``model.lowerDryFrictionLimit`` and ``upperDryFrictionLimit``: the range of Coulomb's friction of
  every coordinate, N and N m. :mod:`exo_pin.chain.dynamics.nonsmooth` has its law.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from ...core.errors import InvalidInput
from ...core.validation import FloatArray, as_choice
from .description import JointProperties
from .motion_axes import q_slice, unit_of, v_slice


class _Spring(NamedTuple):
    """A spring of a joint that turns about all its axes; with its slices of q and v."""

    q: slice
    v: slice
    stiffness: float
    flies: bool
    shift: FloatArray
    turn: FloatArray


def find_joint(model: pin.Model, item: JointProperties) -> int:
    """Index of the joint whose data these are, after a check that they fit it.

    Raises
    ------
    UnknownName
        If there is no such moving joint.
    InvalidInput
        If a value has another unit or number of components than the joint, or a reference is no configuration.
    """
    names = list(model.names)
    as_choice("moving joint", item.joint, names[1:], "joints")
    index = names.index(item.joint, 1)
    unit = None if item.unit is None else unit_of(model, index)
    if item.unit != unit:
        moves = {"m": "in m", "rad": "in rad", None: "in m and rad"}[unit]
        raise InvalidInput(
            f"joints: {item.joint!r} moves {moves}; its data are given for one that moves in {item.unit}"
        )
    sizes = {"armature": model.nvs[index], "spring_reference": model.nqs[index]}
    for key, count in sizes.items():
        values = getattr(item, key)
        if values is not None and len(values) != count:
            raise InvalidInput(f"joints: expected {count} numbers for the {key} of {item.joint!r}, got {len(values)}")
    if item.spring_reference is not None:
        q = pin.neutral(model)
        q[q_slice(model, index)] = item.spring_reference
        if not pin.isNormalized(model, q, 1e-9):
            raise InvalidInput(
                f"joints: expected a spring_reference of {item.joint!r} of length 1 (quaternion x, y, z, w, or "
                f"cosine and sine), got {item.spring_reference}"
            )
    return index


class PassiveForces:
    """Springs and damping of a tree.

    Parameters
    ----------
    model : pinocchio.Model
        The tree; its damping and friction are read at every call.
    joints : iterable of JointProperties
        Springs by joint.

    Raises
    ------
    UnknownName
        If a joint is not in the model.
    InvalidInput
        If data do not fit their joint, see :func:`find_joint`, or the joint cannot carry a spring.
    """

    def __init__(self, model: pin.Model, joints: Iterable[JointProperties]) -> None:
        self._model = model
        # Windows on the model's own arrays.
        self.damping = np.asarray(model.damping)
        self._friction = np.asarray(model.lowerDryFrictionLimit), np.asarray(model.upperDryFrictionLimit)
        self._stiffness, self._reference = np.zeros(model.nv), np.zeros(model.nv)
        self._none = self._stiffness.tobytes(), (-self._stiffness).tobytes()
        self._linear = np.zeros(model.nv, dtype=np.int64)
        self._turning: list[_Spring] = []
        for own in joints:
            self._add(own, find_joint(model, own))
        self._indices = np.flatnonzero(self._stiffness)
        self._q_indices = self._linear[self._indices]
        self.has_springs = bool(len(self._indices) or self._turning)

    def _add(self, own: JointProperties, joint: int) -> None:
        if own.stiffness == 0.0:
            return
        model = self._model
        q, v = q_slice(model, joint), v_slice(model, joint)
        reference = np.array(pin.neutral(model)[q] if own.spring_reference is None else own.spring_reference)
        if model.nqs[joint] == model.nvs[joint]:
            self._stiffness[v], self._reference[v] = own.stiffness, reference
            self._linear[v] = np.arange(q.start, q.stop)
            return
        kind = model.joints[joint].shortname()
        if kind not in ("JointModelSpherical", "JointModelFreeFlyer"):
            raise InvalidInput(
                f"joint {own.joint!r} ({kind}) cannot carry a spring, because its coordinates do not count turns: use "
                "a joint with limits"
            )
        turn = pin.Quaternion(reference[-4:]).normalized().toRotationMatrix()
        flies = kind == "JointModelFreeFlyer"
        self._turning.append(_Spring(q, v, own.stiffness, flies, reference[:3], turn))

    @property
    def is_idle(self) -> bool:
        """Whether there are no springs, no damping and no dry friction."""
        return not (self.act or self.rubs)

    @property
    def rubs(self) -> bool:
        """Whether a joint has dry friction."""
        none, (lower, upper) = self._none, self._friction
        return lower.tobytes() not in none or upper.tobytes() not in none

    @property
    def dry_friction(self) -> tuple[FloatArray, FloatArray]:
        """Least and largest dry friction of every coordinate, shape (nv,) each, N and N m.

        Raises
        ------
        InvalidInput
            If a range does not contain zero or is not finite: such friction would drive the joint.
        """
        lower, upper = self._friction
        wrong = ~((lower <= 0.0) & (upper >= 0.0) & np.isfinite(lower) & np.isfinite(upper))
        if wrong.any():
            at = int(np.flatnonzero(wrong)[0])
            raise InvalidInput(
                f"expected finite limits of dry friction, the lower one at most 0 and the upper one at least 0, got "
                f"{lower[at]} and {upper[at]} in coordinate {at} of v: change model.lowerDryFrictionLimit and "
                "model.upperDryFrictionLimit"
            )
        return lower, upper

    @property
    def act(self) -> bool:
        """Whether there are springs or dampers at all."""
        return self.has_springs or self.damping.tobytes() not in self._none

    def force(self, q: FloatArray, v: FloatArray | None) -> FloatArray:
        """Generalised forces of springs and damping on the joints, N and N m.

        Parameters
        ----------
        q : ndarray
            Shape (..., nq).
        v : ndarray or None
            Shape (..., nv), or None at rest.

        Returns
        -------
        ndarray
            Shape (..., nv).
        """
        found = np.zeros((*q.shape[:-1], self._model.nv)) if v is None else -self.damping * v
        index = self._indices
        if len(index):
            found[..., index] -= self._stiffness[index] * (q[..., self._q_indices] - self._reference[index])
        for spring in self._turning:
            for sample in np.ndindex(q.shape[:-1]):
                found[(*sample, spring.v)] -= spring.stiffness * _difference(spring, q[sample])
        return found

    def change(self, q: FloatArray, dq: FloatArray, dv: FloatArray) -> FloatArray:
        """Change of the generalised forces with changes of q and v, shapes (nv, columns)."""
        found = -self.damping[:, None] * dv
        found -= self._stiffness[:, None] * dq
        for spring in self._turning:
            found[spring.v] -= spring.stiffness * (_difference_rate(spring, q) @ dq[spring.v])
        return found

    def energy(self, q: FloatArray) -> float:
        """Energy of the springs, J."""
        index = self._indices
        stretch = q[self._q_indices] - self._reference[index]
        energy = 0.5 * float(self._stiffness[index] @ stretch**2)
        for spring in self._turning:
            off = _difference(spring, q)
            if spring.flies:
                off = np.concatenate([q[spring.q][:3] - spring.shift, off[3:]])
            energy += 0.5 * spring.stiffness * float(off @ off)
        return energy

    def loss(self, v: FloatArray) -> float:
        """Power that damping dissipates, W; at least zero if no damping is negative."""
        return float(self.damping @ v**2)


def frictionless(model: pin.Model) -> pin.Model:
    """A copy of the model without dry friction."""
    copy, none = model.copy(), np.zeros(model.nv)
    copy.lowerDryFrictionLimit, copy.upperDryFrictionLimit = none, none
    return copy


def _rotation(spring: _Spring, q: FloatArray) -> FloatArray:
    return np.asarray(pin.Quaternion(q[spring.q][-4:]).toRotationMatrix())


def _difference(spring: _Spring, q: FloatArray) -> FloatArray:
    """Displacement from the reference to the joint's configuration, in the axes of its v, shape (3,) or (6,)."""
    R = _rotation(spring, q)
    turn = np.array(pin.log3(spring.turn.T @ R))
    return np.concatenate([R.T @ (q[spring.q][:3] - spring.shift), turn]) if spring.flies else turn


def _difference_rate(spring: _Spring, q: FloatArray) -> FloatArray:
    """Change of :func:`_difference` with a step in the axes of v, shape (3, 3) or (6, 6)."""
    R = _rotation(spring, q)
    turning = np.array(pin.Jlog3(spring.turn.T @ R))
    if not spring.flies:
        return turning
    local = pin.skew(R.T @ (q[spring.q][:3] - spring.shift))
    return np.block([[np.eye(3), local], [np.zeros((3, 3)), turning]])
