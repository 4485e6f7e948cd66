"""The plant as the closed chain, for tests: Pinocchio's tree and loops, with the drives integrated alongside.

Over a short interval the motion is found by waveform relaxation: with the states of the drives given in time, the chain
moves under their tensions (:meth:`exo_pin.ClosedChain.simulate`); with the lengths of the limbs given in time, the
drives follow; and so on until pressures and positions of the drives do not change any more. The first ones are those of
the motion in minimal coordinates, but the result does not depend on them. An interval in which this does not converge
is halved.

The shoulder's friction is the chain's: viscous, and Coulomb's in each axis of the arm by itself, with true sticking.
Limbs are massless.

Source: E. Lelarasmee, A. Ruehli, A. Sangiovanni-Vincentelli, The waveform relaxation method for time-domain analysis of
large scale integrated circuits, IEEE Trans. Computer-Aided Design 1 (1982) 131.
"""

from bisect import bisect_right
from functools import partial

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation

from exo_pin import ExoPinError, SolverFailed
from exo_pin.control.plant.equations.drive_kernels import MOTOR_COLUMNS, drive_rates, limb_tension, manifold_rates
from exo_pin.control.plant.equations.plant_kernels import SHOULDER, advance, stop_moment
from exo_pin.control.plant.simulation import Piece
from exo_pin.control.plant.state import equations_state
from exo_pin.numerics.vectors import matrix
from exo_pin.wrist_chain.equilibrium import EquilibriumModel

#: Least intervals of a piece at whose ends lengths are passed on, longest of them, s, and their share of the shortest
#: vibration's 1/ω: lengths between them are cubic, and stiff drives answer to micrometres.
_NODES, _SPACING, _SHARE = 3, 1.5e-3, 0.1
#: Iterations, and shortest interval, s.
_ITERATIONS, _SHORTEST = 8, 1e-4
#: Changes of a pressure and of a motor's position, over the relative tolerance, at which the iteration ends, Pa and m.
_PRESSURE, _POSITION = 1e6, 1.0
#: The root's own coordinates in v.
_ROOT = slice(0, 3)
#: Greatest moment of the stops in a trial step, N m.
_STRONGEST = 1e6


class ChainMotion:
    """The chain of a plant at one instant, which can be moved on.

    Parameters
    ----------
    plant : Plant
    start : PlantState
        The chain's is found from that of the arm.
    rtol : float
        Relative tolerance.

    Attributes
    ----------
    q, v : ndarray
        Of the chain.
    y : ndarray
        Pressures, friction of the muscles and integrals.
    work, dissipated, opening : float
        Work of tensions, load and stops on the chain, less what load and stops had stored at the start, and what its
        joints dissipated since the start, J; residual of the loops, m and rad.
    """

    def __init__(self, plant, start, rtol):
        self.tables, self.rtol = plant.tables, rtol
        model = EquilibriumModel(plant.mechanism)
        joint = dict(zip(SHOULDER, plant.tables.shoulder.tolist(), strict=True))
        tree = model.model
        tree.damping[_ROOT] = joint["viscous"]
        tree.lowerDryFrictionLimit[_ROOT], tree.upperDryFrictionLimit[_ROOT] = -joint["coulomb"], joint["coulomb"]
        self.chain = model.chain
        n = plant.count
        names = [f"limb_{i + 1}_slide" for i in range(n)]
        self._slides_q = np.array([tree.idx_qs[tree.getJointId(name)] for name in names])
        self._slides_v = np.array([tree.idx_vs[tree.getJointId(name)] for name in names])
        #: Places of the state that belong to the drives: all but the arm and the shoulder's friction.
        self.y = equations_state(start, plant.motors)
        self._air = np.r_[6 : 6 + 2 * n, 9 + 2 * n : len(self.y)]
        self._motors = plant.tables.motors[:, 0] > 0.0
        self._change = np.where(self._motors, _POSITION, _PRESSURE) * rtol
        neutral = plant.mechanism.geometry.neutral.as_matrix()
        #: Lengths of the limbs where their slides are at zero.
        self._neutral = np.linalg.norm(plant.tables.platform @ neutral.T - plant.tables.base, axis=1)
        R = start.orientation.as_matrix()
        self.q = model.configuration(R, start.quaternion)
        self.v = self.chain.dependent_motion(self.q, ["root_joint"], R.T @ start.angular_velocity, np.zeros(3))[0]
        self.work, self.dissipated, self.opening = -self.stored(), 0.0, 0.0
        #: Which muscles are whole, 1 or 0 each.
        self.intact = np.ones(n)

    def stored(self):
        """Energy in load and stops, J."""
        R, joint = self.rotation, self.tables.shoulder
        w = tuple(self.angular_velocity.tolist())
        stops = stop_moment(matrix(R), w, *joint[4:9].tolist())[2] if joint[3] > 0.0 else 0.0
        return float(stops - self.tables.force @ (R @ self.tables.point))

    @property
    def _spacing(self):
        """Longest interval between nodes, s, from the frequencies of arm and drives on the stretch of each limb."""
        tables, row = self.tables, dict(zip(MOTOR_COLUMNS, self.tables.motors.T, strict=True))
        if not self._motors.any():
            return _SPACING
        R = self.rotation
        b = tables.platform @ R.T
        span = b - tables.base
        levers = np.cross(b, span) / np.linalg.norm(span, axis=1)[:, None] @ R
        mobility = np.einsum("ij,jk,ik->i", levers, tables.inverse, levers) + row["inverse_mass"]
        return min(_SPACING, _SHARE / float(np.sqrt((row["stiffness"] * mobility).max())))

    @property
    def rotation(self):
        """Of the arm, shape (3, 3)."""
        return np.asarray(Rotation.from_quat(self.q[:4]).as_matrix())

    @property
    def angular_velocity(self):
        """Of the arm, base frame, shape (3,)."""
        return np.asarray(self.rotation @ self.v[_ROOT])

    def kinematics(self):
        """Quaternion and state of the equations, with ω and ξ = 0."""
        y = self.y.copy()
        y[:3], y[3:6] = 0.0, self.angular_velocity
        return self.q[:4].copy(), y

    def advance(self, pieces):
        """Move on through some pieces of time.

        Raises
        ------
        SolverFailed
            If pressures and motion do not converge in the shortest interval.
        ExoPinError
            As :meth:`exo_pin.ClosedChain.simulate`.
        """
        start, end = pieces[0].start, pieces[-1].end
        try:
            done = self._converged(pieces)
        except ExoPinError:
            # A trial step that is too long for a stop or a braid leads anywhere: a shorter interval has shorter ones.
            if end - start < _SHORTEST:
                raise
            done = False
        if not done:
            if end - start < _SHORTEST:
                raise SolverFailed("waveform relaxation", end - start, "pressures and motion do not converge")
            middle = 0.5 * (start + end)
            self.advance([Piece(p.start, min(p.end, middle), p.flows) for p in pieces if p.start < middle])
            self.advance([Piece(max(p.start, middle), p.end, p.flows) for p in pieces if p.end > middle])

    def _converged(self, pieces):
        """Move on through an interval and return True, or return False and stay."""
        nodes = _nodes(pieces, self._spacing)
        count = len(self._slides_q)
        air = self._air_along(pieces, nodes, *self._guess(pieces, nodes))
        before = np.array([air.at(t)[:count] for t in nodes.tolist()])
        for _ in range(_ITERATIONS):
            moved = self.chain.simulate(
                self.q, self.v, nodes, partial(self._efforts, air), external=self._external, rtol=self.rtol,
                atol=0.01 * self.rtol,
            )  # fmt: skip
            lengths = self._neutral + moved.q[:, self._slides_q]
            air = self._air_along(pieces, nodes, lengths, moved.v[:, self._slides_v])
            after = np.array([air.at(t)[:count] for t in nodes.tolist()])
            if (np.abs(after - before).max(axis=0) <= self._change).all():
                self.q, self.v = moved.q[-1].copy(), moved.v[-1].copy()
                self.y[self._air] = air.at(float(nodes[-1]))
                self.work += float(moved.work[-1])
                self.dissipated += float(moved.dissipated[-1])
                self.opening = max(self.opening, float(moved.opening.max()))
                return True
            before = after
        return False

    def _guess(self, pieces, nodes):
        """Lengths of the limbs and their rates at the nodes, in minimal coordinates."""
        q, y = self.kinematics()
        tables, atol, step = self.tables, np.full(len(y), 1e-10), 1e-4
        atol[6 : 6 + len(self._slides_q)][~self._motors] = 1e-4
        found = [self._limbs(q, y)]
        for start, end in zip(nodes[:-1].tolist(), nodes[1:].tolist(), strict=True):
            flows = next(p.flows for p in pieces if p.start <= start < p.end)
            _, _, step, _ = advance(tables, flows, q, y, end - start, step, 1e-8, atol)
            found.append(self._limbs(q, y))
        lengths, speeds = zip(*found, strict=True)
        return np.array(lengths), np.array(speeds)

    def _limbs(self, q, y):
        b = self.tables.platform @ Rotation.from_quat(q).as_matrix().T
        span = b - self.tables.base
        lengths = np.linalg.norm(span, axis=1)
        return lengths, np.einsum("ij,ij->i", np.cross(b, span / lengths[:, None]), np.broadcast_to(y[3:6], b.shape))

    def _air_along(self, pieces, nodes, lengths, speeds):
        """The air while the limbs have lengths and rates, shape (nodes, n)."""
        curve = CubicHermiteSpline(nodes, lengths, speeds)
        slope = curve.derivative()
        y, out, air = self.y.copy(), np.zeros(len(self.y)), self._air
        scale = np.full(len(air), 1e-2)
        n = len(self._slides_q)
        scale[:n] = np.where(self._motors, 1e-3, 1e3)
        scale[2 * n] = 1e3
        solutions, state = [], self.y[air].copy()
        for piece in pieces:

            def rate(t, x, flows=piece.flows):
                y[air] = x
                self._drives_alone(flows, curve(t), slope(t), y, out)
                return out[air]

            found = solve_ivp(
                rate, (piece.start, piece.end), state, method="DOP853", rtol=0.1 * self.rtol,
                atol=0.1 * self.rtol * scale, dense_output=True,
            )  # fmt: skip
            if not found.success:
                raise SolverFailed("air in the muscles", float("inf"), found.message)
            solutions.append(found.sol)
            state = found.y[:, -1].copy()
        return _Air([piece.start for piece in pieces], solutions)

    def _drives_alone(self, flows, lengths, speeds, y, out):
        """Fill the rates of the drives for given lengths of the limbs and their rates."""
        sums = np.zeros(2)
        for i in range(len(self._slides_q)):
            sums += drive_rates(self.tables, flows, i, y, speeds[i], lengths[i], out)[1:]
        manifold_rates(self.tables, y, *sums.tolist(), out)

    def _efforts(self, air, t, q, v):
        """Efforts of the chain at a time: a tension pulls its slide back."""
        tau, y, count = np.zeros(len(v)), self.y.copy(), len(self._slides_q)
        y[self._air] = air.at(t)
        lengths, speeds = self._neutral + q[self._slides_q], v[self._slides_v]
        pulls = [limb_tension(self.tables, i, y, speeds[i], lengths[i])[0] for i in range(count)]
        tau[self._slides_v] = -self.intact * pulls
        return tau

    def _external(self, t, q, v):
        """Load and stops of the shoulder on the arm, about O, world axes."""
        R, t = Rotation.from_quat(q[:4]).as_matrix(), self.tables
        moment, joint = np.cross(R @ t.point, t.force), t.shoulder
        if joint[3] > 0.0:
            # In a trial step that the integrator will refuse the depth may be anything.
            stop = stop_moment(matrix(R), tuple((R @ v[_ROOT]).tolist()), *joint[4:9].tolist())[0]
            moment = moment + np.clip(stop, -_STRONGEST, _STRONGEST)
        return {"arm": np.concatenate([t.force, moment])}

    def loads(self):
        """Efforts and external wrenches at this instant."""
        still = _Air([0.0], [lambda t: self.y[self._air]])
        return self._efforts(still, 0.0, self.q, self.v), self._external(0.0, self.q, self.v)


class _Air:
    """State of the air in time, piece by piece."""

    def __init__(self, starts, solutions):
        self._starts, self._solutions = starts, solutions

    def at(self, t):
        """At a time, s."""
        return np.asarray(self._solutions[max(bisect_right(self._starts, t) - 1, 0)](t))


def _nodes(pieces, spacing):
    """Times at which lengths are passed on: the ends of the pieces, and some between."""
    parts = []
    for piece in pieces:
        count = max(_NODES, int(np.ceil((piece.end - piece.start) / spacing)))
        parts.append(np.linspace(piece.start, piece.end, count + 1)[:-1])
    return np.append(np.concatenate(parts), pieces[-1].end)
