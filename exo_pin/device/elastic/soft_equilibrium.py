"""Equations of a device that gives way while its drives and brakes keep the coordinates of the rigid, aligned device.

The arm turns by v besides the displacements x of :mod:`.soft_equations`, idle motions that drives hold among them, and
the efforts f are unknown as well:

    T'(λ b - springs - B f) = 0        N'(λ b - springs - B f) = 0        c(v, x) = c(0, 0)

with c the coordinates of drives and brakes.

Weight, load and inertia are those of the arm as it is turned.

Equilibrium of a device that gives way, in a stack of poses that are held by the drives.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput, LoopNotClosed, SolverFailed
from ...core.progress import track
from ...core.validation import FloatArray
from ...load_case.pose_stacks import Query, arm_loads
from ...numerics.vectors import NEAR_MARGIN
from ..balance.balanced_forces import fill_forces
from ..balance.device_loads import device_loads
from ..balance.device_state import DeviceState
from ..chain_device import ChainDevice
from ..device_structure import best_structure, general_configurations
from ..equilibrium import DeviceEquilibrium, PartsMoved, device_equilibrium, margins, nothing_lacking
from ..turns.given_postures import GivenPosture
from ..turns.idle_joints import idle_motions
from .soft_equations import NotEvaluated, OutOfReach, SoftEquations, SoftPose
from .soft_tree import SoftModel
from .springs import CUFF, HARNESS, OF_LINK, SHOULDER

#: A unit of the efforts among the unknowns, over the largest effort or moment of the pose whose drives hold the arm.
_FORCE = 10.0


class LockedEquations(SoftEquations):
    """r of one pose with locked drives, in the unknowns v, x and f; see :class:`.SoftEquations` for parameters.

    Parameters
    ----------
    turned : callable
        Takes an orientation of the arm, shape (3, 3), and returns the question there, a stack of one.
    """

    #: Efforts are unknown, too, and are not zero where a path ends.
    _counts_anew = False

    def __init__(self, turned: Callable[[FloatArray], Query], *given: Any) -> None:
        super().__init__(*given)
        self._turned, self._rest = turned, (self.start.copy(), Rotation.from_matrix(self.matrix))
        drives = len(self.model.drives)
        loads = device_loads(self.model, self.start[None], self.query)
        self._locked = loads.driven.coordinates[0].copy()
        self.columns = self._held_motions(loads.driven.B[0])
        own = self.columns.shape[1]
        self.size, self._ends = 3 + own + drives, (3, 3 + own)
        start = super().at(np.zeros(own), 1.0)
        # Turns of the arm, and what moves drives besides while it rests.
        values = np.linalg.svd(start.drive_effect[:, :drives], compute_uv=False)
        least = self.model.none * np.linalg.norm(start.moment_of_f[:3])
        most = 3 + int((values > least).sum())
        if drives > most:
            raise InvalidInput(
                f"expected at most {most} drives and brakes with locked actuators, got {drives}: a device with "
                f'{most} freedoms cannot have more given lengths. split="elastic" lets the actuators adapt'
            )
        #: What a unit of f is, N or N m.
        self._unit = _FORCE * np.linalg.norm([1e-6, *start.f, *start.moment])

    def _held_motions(self, efforts: FloatArray) -> FloatArray:
        """Motions of the held tree at the start that load a spring or move a drive, scaled, orthonormal, (nv, m)."""
        model, idle = self.model, idle_motions(self.model, self.start, self.model.none)
        _, s, Vt = np.linalg.svd(np.concatenate([idle[model.soft], efforts.T @ self._of_free(idle)]))
        return idle @ Vt[: int((s > model.none * s[:1]).sum())].T

    def at(self, x: FloatArray, share: float) -> SoftPose:
        """The device at v, x and f."""
        v, own, f = np.split(x, self._ends)
        start, rest = self._rest
        turn = Rotation.from_rotvec(v) * rest
        self.matrix, drives, f = turn.as_matrix(), self._unit * f, np.zeros(self.soft.device.limb_count)
        f[: len(drives)] = drives  # nothing of the wearer
        self.start = start.copy()
        self.start[self.model.arm_q] = turn.as_quat()
        self.query, device = self._turned(self.matrix), self.soft.device
        self.on_cuff = arm_loads(device.require_arm("weight"), device.gravity, self.query)[2][0]
        self.preferred = f
        pose = super().at(own, share)
        residual = np.concatenate(
            [
                pose.moment[:3] - pose.moment_of_f[:3] @ f,
                pose.residual + pose.drive_effect @ (pose.f - f),
                pose.loads.driven.coordinates[0] - self._locked,
            ]
        )
        return pose._replace(f=f, stress=np.zeros((len(f), 0)), residual=residual)

    def opens(self, x: FloatArray, share: float) -> bool:
        """As of :meth:`.SoftEquations.opens`."""
        return super().opens(np.split(x, self._ends)[1], share)


#: Codes of the status of a pose without an equilibrium nearby, and of one that the displaced device does not reach.
_NOT_SOLVED, _NO_EQUILIBRIUM, _OUT_OF_REACH = 4, 5, 10
#: Largest miss of the balance of forces on the arm, relative to the largest of them.
_BALANCED = 1e-7
#: Load of a motion that neither drive, brake nor spring holds, over the largest load of any joint, that is rounding.
_LOOSE = 1e-8
#: Decimals of coordinates, m and rad, by which configurations of one pose are the same.
_SAME_DIGITS = 10


@lru_cache(maxsize=32)
def soft_model(device: ChainDevice) -> SoftModel:
    """Made once for devices that are asked again; they are compared by identity."""
    return SoftModel(device)


@lru_cache(maxsize=32)
def determined_device(device: ChainDevice) -> ChainDevice:
    """The device on its springs, with what equilibrium does not determine all the same."""
    model = soft_model(device)
    rest = model.rigid.arm_q
    places = [model.start(q, q[rest]) for q in general_configurations(model.rigid)]
    own = best_structure(model.model, np.array(places))
    soft: ChainDevice = model.soft
    rigid = device.structure
    vars(soft)["structure"] = replace(own, moments=rigid.moments, held=rigid.held, scales=rigid.scales)
    return soft


def soft_equilibrium(
    device: ChainDevice,
    query: Query,
    base: FloatArray,
    cuff: FloatArray,
    progress: bool = False,
    preferred: FloatArray | None = None,
    rows: NDArray[np.intp] | None = None,
    posture: GivenPosture | None = None,
    turned: Callable[[int, FloatArray], Query] | None = None,
) -> DeviceEquilibrium:
    """Equilibrium of N poses.

    Parameters
    ----------
    device : ChainDevice
        With something that gives way.
    query : Query
        Poses, motion and load.
    base, cuff : ndarray
        Shifts of torso side and arm side, shape (N, 3), m, in base and arm frame.
    progress : bool
        Whether to show a bar.
    preferred : ndarray, optional
        Efforts, shape (N, p), that those of the equilibrium are nearest to; of least norm if left out.
    rows : ndarray of int, optional
        Poses to solve; all if left out.
    posture : GivenPosture, optional
        Values of idle joints.
    turned : callable, optional
        Of locked drives: the question of a pose, by its number, with the arm in another orientation, shape (3, 3).
    """
    count, p, model = len(query.matrices), device.limb_count, soft_model(device)
    # The rigid, aligned device: where it goes, and where the search for equilibrium begins.
    rigid = device_equilibrium(device, query, progress=progress, posture=posture)
    state = DeviceState.zeros(count, p, model.model.attachments.entries, device.structure.held)
    status, margin = rigid.status.copy(), rigid.margin.copy()
    moved = PartsMoved.none(count, len(device.soft_links), p)
    moved.arm[:] = query.matrices
    lacking = nothing_lacking(count)
    q = np.zeros((count, model.model.held.nq))
    coordinates = rigid.coordinates.copy()
    arm = device.require_arm("weight")
    of_arm, _, on_cuff = arm_loads(arm, device.gravity, query)
    asked = np.arange(count) if rows is None else rows
    solvable = rigid.reached & ~rigid.unheld.any(axis=1)
    # By the pose: what was found with one offset helps to find the equilibrium with another.
    known = dict[bytes, SoftEquations]()
    for k in track(asked[solvable[asked]].tolist(), "equilibrium on springs", progress):
        wanted = np.zeros(p) if preferred is None else preferred[k]
        given = model, rigid.q[k], query, k, base[k], cuff[k], wanted, on_cuff[k]
        if turned is None:
            asked_there = (*(part[k] for part in query[1:]), wanted, rigid.q[k].round(_SAME_DIGITS) + 0.0)
            there = b"".join(part.tobytes() for part in asked_there)
            equations = known[there] = known.get(there) or SoftEquations(*given)
            equations.move(base[k], cuff[k])
        else:
            equations = LockedEquations(partial(turned, k), *given)
        try:
            pose, x = equations.solved()
            if pose.loose > _LOOSE * float(np.abs(pose.loads.tau).max()):
                raise SolverFailed("motions that nothing holds", 1.0, "displacements of the parts that give way")
            one, here = _forces(equations, pose)
            load = of_arm[k] if turned is None else arm_loads(arm, device.gravity, equations.query)[0][0]
            _check_balance(here, load)
            _fill(state, k, equations, pose, x, one, here)
            moved.share[k] = 1.0
        except NotEvaluated as error:
            moved.share[k], status[k], lacking[k] = error.residual, _NOT_SOLVED, error.lacking
            continue
        except SolverFailed as error:
            moved.share[k] = error.residual
            status[k] = _OUT_OF_REACH if isinstance(error, OutOfReach) else _NO_EQUILIBRIUM
            continue
        except (LoopNotClosed, np.linalg.LinAlgError):
            moved.share[k], status[k] = 0.0, _NO_EQUILIBRIUM
            continue
        margin[k] = margins(pose.moment_of_f[None, :, : len(device.efforts)], device.structure)[0][0]
        q[k], status[k] = pose.q, int(min(margin[k], rigid.margin[k]) < NEAR_MARGIN)
        coordinates[k, : len(device.efforts)] = pose.loads.driven.coordinates[0]
        _put(moved, k, equations.displaced(pose.q), device)
        moved.arm[k], moved.efforts[k] = equations.matrix, pose.f
        effects = equations.undetermined(pose)
        moved.undetermined[k] = effects.shape[1]
        moved.determined[k] = np.linalg.norm(effects, axis=1) <= model.model.none
    # By the joints of the soft tree: it has more, and others in the place of guides that bend.
    names, soft = list(model.rigid.free.model.names), model.model.free.model
    unheld, kept = np.zeros((count, soft.njoints)), [k for k, name in enumerate(names) if soft.existJointName(name)]
    unheld[:, [soft.getJointId(names[k]) for k in kept]] = rigid.unheld[:, kept]
    margin[status == _NO_EQUILIBRIUM] = np.nan
    return rigid._replace(
        state=state, q=q, coordinates=coordinates, status=status, margin=margin, unheld=unheld, lacking=lacking,
        moved=moved,
    )  # fmt: skip


def _put(moved: PartsMoved, k: int, displaced: dict[str, FloatArray], device: ChainDevice) -> None:
    """Write the displacements of one pose."""
    for row, name in enumerate((HARNESS, CUFF)):
        moved.interfaces[k, row] = displaced.get(name, 0.0)
    moved.centre[k] = 0.0 - displaced.get(SHOULDER, np.zeros(3))
    for row, soft in enumerate(device.soft_links):
        moved.links[k, row] = displaced[soft.link + OF_LINK]


def _forces(equations: SoftEquations, pose: SoftPose) -> tuple[DeviceState, FloatArray]:
    """Forces of one pose, as a stack of one, and at its efforts those on shoulder, arm and torso in a row."""
    one = DeviceState.zeros(1, len(pose.f), equations.model.attachments.entries)
    fill_forces(equations.model, pose.loads, equations.matrix[None], equations.on_cuff[None], one)
    return one, one.all_forces(pose.f[None], np.zeros((1, len(pose.f))))[0]


def _check_balance(here: FloatArray, of_arm: FloatArray) -> None:
    """Raise where shoulder, attachments and the arm's own load do not balance: no number then goes out."""
    shoulder, on_arm = here[:3], here[3:-6].reshape(-1, 6)[:, :3]
    missing = shoulder + on_arm.sum(axis=0) + of_arm
    if not np.abs(missing).max() <= _BALANCED * max(1e-9, *np.abs(here[:3]), *np.abs(of_arm), np.abs(on_arm).max()):
        raise SolverFailed("forces on the arm", 0.0, "the device's own loops")


def _fill(
    state: DeviceState,
    k: int,
    equations: SoftEquations,
    pose: SoftPose,
    x: FloatArray,
    one: DeviceState,
    here: FloatArray,
) -> None:
    """Write the forces of one pose, as they change with efforts that balance the arm and move the springs."""
    rows = min(len(pose.moment), state.moment.shape[1])
    state.moment_of_f[k, :rows], state.moment[k, :rows] = pose.moment_of_f[:rows], pose.moment[:rows]
    state.forces_of_g[k] = one.forces_of_g[0]
    stress = pose.stress
    ends = equations.response(pose, x, stress) if stress.shape[1] else []
    slopes = [(_forces(equations, more)[1] - _forces(equations, less)[1]) / apart for more, less, apart in ends]
    change = np.array(slopes).reshape(-1, len(here)).T @ stress.T
    state.forces[k], state.forces_of_f[k] = here - change @ pose.f, change
