"""A closed chain as an action model of Crocoddyl, in its independent coordinates (extra ``optimal-control``).

The state is x = (q_i, v_i) of the joints that lead; all others follow on the closed loops, so that an optimal motion
opens none and no constraint is left to the solver. The controls are the efforts of the motors.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import ExoPinError, InvalidInput
from ..core.optional_packages import optional
from ..core.validation import FloatArray, require_type
from .closed_chain import ClosedChain

try:
    import crocoddyl
except ImportError:
    crocoddyl = None

_Model: Any = object if crocoddyl is None else crocoddyl.DifferentialActionModelAbstract
_Data: Any = object if crocoddyl is None else crocoddyl.DifferentialActionDataAbstract
#: Largest step of a leading joint from one closed configuration to the next, rad and m: a solver tries far motions.
_STEP = 0.3


def action_model(
    chain: ClosedChain, q: ArrayLike, independent: Iterable[str], motors: Iterable[str], costs: Any
) -> ClosedChainAction:
    """A closed chain's forward dynamics with its derivatives, for ``crocoddyl.IntegratedActionModelEuler`` and others.

    Parameters
    ----------
    chain : ClosedChain
        The robot.
    q : array_like
        Shape (nq,), a closed configuration; its branch is the one that is followed.
    independent : iterable of str
        Joints of one coordinate that determine all others.
    motors : iterable of str
        Joints whose efforts are the controls, N and N m.
    costs : callable
        From the state and the number of controls to a ``crocoddyl.CostModelSum``.

    Returns
    -------
    ClosedChainAction
        A ``crocoddyl.DifferentialActionModelAbstract``; its ``configuration`` takes q_i to the closed q.

    Raises
    ------
    MissingExtra
        If Crocoddyl is not installed.
    InvalidInput
        If a joint that leads has several coordinates.
    UndeterminedMotion
        If the joints that lead do not determine the others.

    Examples
    --------
    >>> import crocoddyl
    >>> from exo_pin.chain import action_model
    >>> rod = '<joint name="hinge" axis="0 1 0"/><inertial mass="2" pos="0 0 -0.5" diaginertia="0.1 0.1 0.1"/>'
    >>> chain = ep.ClosedChain.from_mjcf(f"<mujoco><worldbody><body>{rod}</body></worldbody></mujoco>")
    >>> model = action_model(chain, [0.0], ["hinge"], ["hinge"], crocoddyl.CostModelSum)
    >>> data = model.createData()
    >>> model.calc(data, np.array([0.4, 0.0]), np.array([0.0]))
    >>> data.xout.round(4)  # rad/s², - m g l sin q over the inertia of 0.6 kg m²
    array([-6.367])
    """
    optional("optimal-control", "crocoddyl")
    require_type("chain", chain, ClosedChain)
    joints = tuple(independent)
    parts = [chain.configuration_slice(joint) for joint in joints]
    if any(part.stop - part.start != 1 for part in parts):
        raise InvalidInput(f"expected joints of one coordinate to lead, got {', '.join(joints)}")
    start = chain.close(q, hold=joints)
    # Raises where these joints do not determine the others.
    chain.reduced_jacobian(start, joints)
    return ClosedChainAction(chain, start, joints, [part.start for part in parts], tuple(motors), costs)


class ClosedChainAction(_Model):
    """What :func:`action_model` makes."""

    def __init__(
        self, chain: ClosedChain, start: FloatArray, joints: tuple[str, ...], places: list[int],
        motors: tuple[str, ...], costs: Any,
    ) -> None:  # fmt: skip
        self.chain, self.start, self.joints, self._places = chain, start, joints, places
        self._own, self._motors = chain.velocity_indices(joints), chain.velocity_indices(motors)
        state, count = crocoddyl.StateVector(2 * len(places)), len(self._motors)
        self.costs = costs(state, count)
        super().__init__(state, count, self.costs.nr)

    def createData(self) -> Any:
        """What Crocoddyl hands to the functions below."""
        return _ActionData(self)

    def calc(self, data: Any, x: FloatArray, u: FloatArray | None = None) -> None:
        """Acceleration of the independent coordinates and cost, NaN where no regular closed configuration is near.

        A solver takes a shorter step then; it cannot handle a Python exception.
        """
        if u is not None:
            with self._or_nan(data.xout):
                data.xout = self.chain.forward_dynamics(*self._motion(data, x, u)).a[self._own]
        self._cost("calc", data, x, u)

    def calcDiff(self, data: Any, x: FloatArray, u: FloatArray | None = None) -> None:
        """Derivatives of both."""
        if u is not None:
            with self._or_nan(data.Fx, data.Fu):
                by = self.chain.forward_dynamics_derivatives(*self._motion(data, x, u), independent=self.joints)
                data.Fx = np.hstack([by.independent_q, by.independent_v])
                data.Fu = by.independent_tau[:, self._motors]
        self._cost("calcDiff", data, x, u)

    @staticmethod
    @contextmanager
    def _or_nan(*arrays: FloatArray) -> Iterator[None]:
        try:
            yield
        except ExoPinError:
            for array in arrays:
                array[:] = np.nan

    def configuration(self, q_independent: ArrayLike, near: FloatArray | None = None) -> FloatArray:
        """The closed configuration, shape (nq,), of coordinates of shape (d,), from one nearby in small steps.

        Raises LoopNotClosed where the loops do not close on the way.
        """
        q = (self.start if near is None else near).copy()
        left = np.asarray(q_independent, dtype=float) - q[self._places]
        steps = max(int(np.ceil(np.abs(left).max(initial=0.0) / _STEP)), 1)
        for _ in range(steps):
            q[self._places] += left / steps
            q = np.array(self.chain.close(q, hold=self.joints))
        return q

    def _motion(self, data: Any, x: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """q, v and τ of all coordinates; the data has the last q, from which the next is near."""
        d = len(self._own)
        data.q = self.configuration(x[:d], data.q)
        tau = np.zeros(self.chain.model.nv)
        tau[self._motors] = u
        return data.q, self.chain.reduced_jacobian(data.q, self.joints) @ x[d:], tau

    def _cost(self, what: str, data: Any, x: FloatArray, u: FloatArray | None) -> None:
        given = (data.costs, x) if u is None else (data.costs, x, u)
        getattr(self.costs, what)(*given)
        data.cost = data.costs.cost


class _ActionData(_Data):
    """Crocoddyl's data, with that of the costs and the last configuration."""

    def __init__(self, model: ClosedChainAction) -> None:
        super().__init__(model)
        self.q = model.start
        self.costs = model.costs.createData(crocoddyl.DataCollectorAbstract())
        self.costs.shareMemory(self)
