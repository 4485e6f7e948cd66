"""The equations of motion of a device in one pose, solved for the forces; see :mod:`exo_pin.device.equilibrium`."""

from __future__ import annotations

import numpy as np
import scipy

from ...chain.dynamics.equations.equations_of_motion import EquationsOfMotion, equations_of_motion
from ...chain.kinematics.loops import constraint_drift
from ...core.validation import FloatArray
from ...load_case.pose_stacks import Query
from ..device_model import DeviceModel
from ..parts.lacking_data import LackingData
from ..parts.routes import PlacedRoute
from ..postures import following
from .device_state import DeviceState
from .idle_motions import UNBALANCED, Freedoms, idle_rows, split_motions
from .least_loads import NONE, couple_at, least_in_order

__all__ = ["attachment_count"]

#: An attachment along a route puts no couple on the arm: its point does not count.
_NO_POINT = np.full(3, np.nan)


def attachment_count(model: DeviceModel) -> int:
    """Attachments of the device on the arm: joints, loops, and each route that ends on the arm."""
    joints = (model.joints == model.arm).any(axis=1).sum()
    routes = [place for _, place in (*model.drives, *model.springs) if isinstance(place, PlacedRoute)]
    return int(len(model.hanging) + joints + sum((place.joints == model.arm).any() for place in routes)) or 1


class DriveMap:
    """What the drives do in one pose; springs and loads are no part of it.

    Attributes
    ----------
    B : ndarray
        Generalised force on the free tree for an effort of one, shape (nv, efforts).
    pulls : list of ndarray or None
        Wrenches of a tension of 1 N of each routed drive on the bodies, shape (njoints, 6); None of the others.
    coordinates : ndarray
        Shape (efforts,), m or rad.
    lacking : tuple of LackingData
        Routed drives without a direction, whose columns are zero.
    """

    def __init__(self, model: DeviceModel, equations: EquationsOfMotion) -> None:
        self.model, poses, count = model, equations.poses, len(model.drives)
        self.J_columns = np.array(model.free.buffers.J)
        self.B, self.coordinates = np.zeros((model.free.nv, count)), np.empty(count)
        self.pulls: list[FloatArray | None] = [None] * count
        lacking = []
        for i, (drive, place) in enumerate(model.drives):
            self.coordinates[i] = drive.zero_length + model.coordinate(place, equations.q, poses)
            if not isinstance(place, PlacedRoute):
                self.B[place, i] = -1.0 if drive.pulls else 1.0
            elif place.has_direction(poses):
                self.pulls[i] = pull = place.wrenches(poses)
                self.B[:, i] = self.generalised(pull)
            else:
                lacking.append(LackingData("drive", drive.name))
        self.lacking = tuple(lacking)

    def generalised(self, wrenches: FloatArray) -> FloatArray:
        """Generalised forces of wrenches on the bodies, about the world's origin."""
        carried = self.model.carried @ wrenches
        return np.einsum("ci,ci->c", self.J_columns, carried[self.model.owners])


class PoseForces:
    """The equations of one pose, solved for the forces.

    ``lacking`` are the parts whose data do not cover the pose. A spring of them gives no force here; of drives
    ``is_driven`` says whether all have a direction.
    """

    def __init__(
        self,
        model: DeviceModel,
        equations: EquationsOfMotion,
        v: FloatArray,
        load: FloatArray,
        R: FloatArray,
        on_cuff: FloatArray,
    ) -> None:
        self.model, self.equations, self.R, self.on_cuff = model, equations, R, on_cuff
        driven, poses = DriveMap(model, equations), equations.poses
        self.B, self.pulls, self.coordinates = driven.B, driven.pulls, driven.coordinates
        self.rates = self.B.T @ v
        tau, self.spring_wrenches = equations.tau.copy(), np.zeros((model.free.model.njoints, 6))
        self.spring_routes: list[FloatArray] = []
        forces, lacking, self.data_margin = model.spring_forces(equations.q, poses)
        self.lacking, self.is_driven = (*driven.lacking, *lacking), not driven.lacking
        for force, (_, place) in zip(forces.tolist(), model.springs, strict=True):
            if not isinstance(place, PlacedRoute):
                tau[place] += force
            elif force:
                wrench = force * place.wrenches(poses)
                self.spring_routes.append(wrench)
                self.spring_wrenches += wrench
                tau -= driven.generalised(wrench)
        # The load acts on the arm, in whose axes its rows are; its moment is about O, where the arm's joint is.
        tau[model.linear] -= R.T @ load[:3]
        tau[model.angular] -= R.T @ load[3:]
        self.tau = tau

    @classmethod
    def of(cls, model: DeviceModel, q: FloatArray, query: Query, k: int, on_cuff: FloatArray) -> PoseForces:
        """The equations at a configuration and the motion of pose k.

        Parameters
        ----------
        model : DeviceModel
            The device.
        q : ndarray
            Closed configuration of the held tree.
        query : Query
            Poses, motion and load.
        k : int
            The pose.
        on_cuff : ndarray
            Weight and inertia of the device's links that are welded to the arm, shape (6,), about O, base frame. The
            arm's body has their mass, but they load the cuff, as all of the device does.
        """
        R, turn, push = query.matrices[k], query.velocity[k], query.acceleration[k]
        v = a = np.zeros(model.held.nv)
        if turn.any() or push.any():
            v = following(model, q, R.T @ turn)
            a = following(model, q, R.T @ push, constraint_drift(model.held, q, v))
        v = model.free_motion(v)
        equations = equations_of_motion(model.free, model.free_configuration(q), v, model.free_motion(a))
        return cls(model, equations, v, np.concatenate([query.force[k], query.moment[k]]), R, on_cuff)

    def motions(self) -> FloatArray:
        """Motions of all coordinates but the arm's translation that the loops allow, shape (rest, k)."""
        rest, top = self.model.rest, self.model.free.topology
        J = self.equations.jacobian[:, rest] * top.row_scale[:, None] * top.column[rest]
        _, s, Vt = np.linalg.svd(J)
        rank = int((s > NONE * s[0]).sum()) if s.size else 0
        return np.asarray(top.column[rest][:, None] * Vt[rank:].T)

    def fill(self, state: DeviceState, k: int) -> Freedoms:
        """Write the forces of the pose into a stack, and say what else equilibrium needs."""
        model, rest, own = self.model, self.model.rest, self.B.shape[1]
        J, top = self.equations.jacobian, self.model.free.topology
        row, column = top.row_scale, top.column
        U, s, Vt = np.linalg.svd(J[:, rest] * row[:, None] * column[rest])
        rank = int((s > NONE * s[0]).sum()) if s.size else 0
        inverse = (Vt[: rest.size][:rank].T / s[:rank]) @ U[:, :rank].T if rank else np.zeros((rest.size, len(J)))
        turning, idle, size = split_motions(Vt[rank:].T, np.searchsorted(rest, model.angular), self.R)
        loads = column[rest][:, None] * np.column_stack([self.tau, self.B])[rest]
        state.moment_of_f[k, :3, :own] = turning.T @ loads[:, 1:]
        state.moment[k, :3] = turning.T @ loads[:, 0]
        p = state.moment_of_f.shape[2]
        if p > own:
            state.moment_of_f[k, :3, own:] = np.eye(3)
        held, free = idle_rows(idle, loads[:, 1:], state.moment_of_f[k, :3, :own])
        rows = min(held.shape[1], state.moment.shape[1] - 3)
        state.moment_of_f[k, 3 : 3 + rows, :own] = held[:, :rows].T @ loads[:, 1:]
        state.moment[k, 3 : 3 + rows] = held[:, :rows].T @ loads[:, 0]
        # Loads as columns: constant, then of the drives' efforts and of the wearer's moments.
        columns = np.zeros((model.free.nv, 1 + p))
        columns[:, 0], columns[:, 1 : 1 + own] = self.tau, -self.B
        if p > own:
            columns[np.ix_(model.angular, np.arange(1 + own, 1 + p))] = -self.R.T
        # What a column lacks to balance the turns of the arm acts on the arm itself, whoever makes it. What it lacks to
        # balance idle motions is left out: nothing of that is left of the sum in equilibrium.
        columns[model.angular] -= self.R.T @ (turning.T @ (column[rest][:, None] * columns[rest]))
        multipliers = row[:, None] * (inverse.T @ (column[rest][:, None] * columns[rest]))
        stresses = row[:, None] * U[:, rank:]
        self._fill_forces(state, k, columns, multipliers, stresses)
        return Freedoms(size, stresses.shape[1], held.shape[1], free.shape[1], self._unheld(free, loads[:, 0]))

    def _unheld(self, free: FloatArray, load: FloatArray) -> FloatArray:
        """Effort that is missing at each joint, shape (njoints,), N or N m, where motions without drive are loaded.

        Parameters
        ----------
        free : ndarray
            Motions on which no drive acts, scaled, orthonormal, shape (rest, k).
        load : ndarray
            Load, scaled, shape (rest,).
        """
        model = self.model
        column, out = model.free.topology.column, np.zeros(model.free.model.njoints)
        # Loads are sums of weights: rounding is relative to the largest of them, wherever it acts.
        scale = max(float(np.abs(column * part).max()) for part in (self.tau, self.equations.tau))
        missing = free.T @ load
        if not missing.size or np.abs(missing).max() <= UNBALANCED * scale:
            return out
        # Of several motions, as many joints as move most, each with the effort that would hold them all.
        chosen = scipy.linalg.qr(free.T, mode="r", pivoting=True)[1][: len(missing)]
        efforts = np.linalg.solve(free[chosen].T, missing)
        for at, effort in zip(model.rest[chosen], efforts, strict=True):
            if abs(effort) > UNBALANCED * scale:
                out[model.owners[at]] += abs(effort) / column[at]
        return out

    def _fill_forces(
        self, state: DeviceState, k: int, columns: FloatArray, multipliers: FloatArray, stresses: FloatArray
    ) -> None:
        """Shoulder force and attachments for multipliers (rows, 1 + p), with their undetermined part chosen."""
        model, p = self.model, state.moment_of_f.shape[2]
        across = self.R @ self.equations.jacobian[:, model.linear].T
        at_arm, points = self._at_arm(multipliers, p)
        of_stress = self._of_multipliers(stresses)
        welded = np.zeros((6, 1 + p))
        welded[:, 0] = self.on_cuff
        effects, present = self._wanted(of_stress, points), self._wanted(at_arm, points, welded)
        choice = least_in_order(effects, present)
        at_arm = at_arm + of_stress @ choice
        multipliers = multipliers + stresses @ choice
        shoulder = self.R @ columns[model.linear] - across @ multipliers
        # Loads of the columns are the left side: tau, and what of B f stands on the right with the other sign.
        state.shoulder[k], state.shoulder_of_f[k] = shoulder[:, 0], shoulder[:, 1:]
        open_ = -across @ stresses
        U, s, Vt = np.linalg.svd(open_)
        rank = int((s > NONE * max(1.0, s[0])).sum()) if s.size else 0
        sides = np.zeros((stresses.shape[1], rank))
        if rank:
            # Unit forces along the base frame's axes where all three are open, with the least couples that make them.
            target = np.eye(3) if rank == 3 else U[:, :rank]
            basis = Vt[:rank].T @ np.diag(1.0 / s[:rank]) @ U[:, :rank].T @ target
            null = Vt[rank:].T
            sides = basis + null @ least_in_order([part @ null for part in effects], [part @ basis for part in effects])
            state.shoulder_of_g[k, :, :rank] = open_ @ sides
        state.attached[k], state.attached_of_f[k] = at_arm[..., 0], at_arm[..., 1:]
        state.attached_of_g[k, ..., :rank] = of_stress @ sides
        standing = self._standing(multipliers, p)
        state.standing[k, 0], state.standing_of_f[k, 0] = standing[:, 0], standing[:, 1:]
        state.standing_of_g[k, 0, :, :rank] = self._standing_of(stresses @ sides)

    def _wanted(self, wrenches: FloatArray, points: FloatArray, welded: FloatArray | float = 0.0) -> list[FloatArray]:
        """What is made least, in this order: couple and force at the cuff, then couples and forces of the attachments.

        Parameters
        ----------
        wrenches : ndarray
            Of the attachments on the arm, shape (c, 6, k), about O.
        points : ndarray
            Theirs from O, shape (c, 3).
        welded : ndarray or float
            Of the links that are welded to the arm, shape (6, k), about O: they and the attachments are what the
            cuff bears.
        """
        width = wrenches.shape[2]
        each = [
            np.concatenate([couple_at(wrench, point) for wrench, point in zip(wrenches, points, strict=True)]),
            wrenches[:, :3].reshape(3 * len(wrenches), width),
        ]
        if self.model.cuff is None:
            return each
        total = wrenches.sum(axis=0) + welded
        return [couple_at(total, self.R @ self.model.cuff), total[:3], *each]

    # Wrenches, as columns: constant, then one for each effort; moments about O

    def _about_centre(self, wrenches: FloatArray) -> FloatArray:
        """Wrenches about the world's origin, shape (..., 6, k), about O."""
        out = np.array(wrenches)
        out[..., 3:, :] -= np.cross(self.model.centre, wrenches[..., :3, :], axisa=0, axisb=-2, axisc=-2)
        return out

    def _closures(self, multipliers: FloatArray) -> FloatArray:
        """Wrench of every loop on the body of its frame a, shape (m, 6, k), about the world's origin."""
        rows = self.model.free.topology.rows
        unit = self.equations.unit
        return np.array(
            [unit[rows[c] : rows[c + 1]].T @ multipliers[rows[c] : rows[c + 1]] for c in range(len(rows) - 1)]
        ).reshape(len(rows) - 1, 6, multipliers.shape[1])

    def _routed(self, p: int) -> FloatArray:
        """Wrenches of drives and springs along routes on every body, shape (njoints, 6, 1 + p)."""
        out = np.zeros((len(self.equations.poses), 6, 1 + p))
        out[:, :, 0] = self.spring_wrenches
        for i, wrenches in enumerate(self.pulls):
            if wrenches is not None:
                out[:, :, 1 + i] = wrenches
        return out

    def _of_multipliers(self, multipliers: FloatArray) -> FloatArray:
        """Part of the attachments' wrenches on the arm that multipliers make, shape (c, 6, k), about O."""
        model, loops = self.model, self._closures(multipliers)
        carried = model.free.topology.carried[model.hanging]
        parts = [np.einsum("hm,mik->hik", carried, loops)]
        on = model.joints == model.arm
        sign = on[:, 0].astype(float) - on[:, 1]
        touching = on.any(axis=1)
        parts.append(sign[touching, None, None] * loops[touching])
        found = np.concatenate(parts)
        places = attachment_count(model)
        out = np.zeros((places, 6, multipliers.shape[1]))
        out[: len(found)] = found
        return self._about_centre(out)

    def _at_arm(self, multipliers: FloatArray, p: int) -> tuple[FloatArray, FloatArray]:
        """Wrenches of the attachments on the arm, shape (c, 6, 1 + p), about O, and their points, shape (c, 3)."""
        model, poses = self.model, self.equations.poses
        out, routed = self._of_multipliers(multipliers), self._routed(p)
        hanging = len(model.hanging)
        own = np.zeros((len(out), 6, 1 + p))
        # What the arm's child transmits to the arm: minus the weight and inertia of all that it carries.
        own[:hanging, :, 0] = -self.equations.tree[model.hanging]
        own[:hanging] += np.einsum("hj,jik->hik", model.carried[model.hanging], routed)
        points = [poses[j][3] for j in model.hanging]
        for c in np.flatnonzero((model.joints == model.arm).any(axis=1)):
            frame = model.free.topology.frame(int(c), 1)
            carrier = poses[model.joints[c, 1]]
            points.append(carrier[3] + carrier[:3].T @ frame.translation)
        place = len(points)
        for column, wrenches in [
            *((0, wrenches) for wrenches in self.spring_routes),
            *((1 + i, wrenches) for i, wrenches in enumerate(self.pulls) if wrenches is not None),
        ]:
            if wrenches[model.arm].any():
                own[place, :, column] = wrenches[model.arm]
                points.append(_NO_POINT)
                place += 1
        points += [_NO_POINT] * (len(out) - len(points))
        return out + self._about_centre(own), np.array(points) - model.centre

    def _standing(self, multipliers: FloatArray, p: int) -> FloatArray:
        """Wrench of the device on the torso, shape (6, 1 + p), about O."""
        model, routed = self.model, self._routed(p)
        own = np.zeros((6, 1 + p))
        own[:, 0] = -self.equations.tree[model.standing].sum(axis=0)
        own += np.einsum("hj,jik->ik", model.carried[model.standing], routed) + routed[0]
        return self._standing_of(multipliers) + self._about_centre(own)

    def _standing_of(self, multipliers: FloatArray) -> FloatArray:
        """Part of it that multipliers make, shape (6, k)."""
        model, loops = self.model, self._closures(multipliers)
        carried = model.free.topology.carried[model.standing].sum(axis=0)
        on = model.joints == 0
        bodies = (model.joints != 0).any(axis=1)  # a coupling joins no bodies
        sign = carried + np.where(bodies, on[:, 0].astype(float) - on[:, 1], 0.0)
        return self._about_centre(np.einsum("m,mik->ik", sign, loops))
