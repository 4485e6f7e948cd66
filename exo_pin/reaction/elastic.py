"""Split "elastic": side forces and shoulder force by stiffness, at the displaced geometry.

The centre of the arm's joint moves by δ until the shoulder's spring, the guides of UPU limbs and, where they are not
rigid, harness and cuff carry load and centre offset; forces act along the displaced limbs. The equations, their
assumptions and their solution are those of :mod:`exo_pin.wrist.forces.elastic_equilibrium`. There are two assumptions
on the actuators:

- "elastic", held: the arm stays in the given pose. The actuators adapt, so that their forces balance the moments;
  tensions that balance themselves are of least norm.
- "elastic_locked": the limbs have the lengths of the aligned device in the given pose. Load and offset move and
  turn the arm, which determines all forces, also with more than three limbs.

At a given geometry, with S_i the force of the side wrench of limb i and misfit_i the distance of the centres along it,

    g_i = k_i (S_i · δ + misfit_i)          F_s = -K_s δ

For given tensions this is the δ of least strain energy ½ δᵀ K_s δ + ½ Σ k_i (S_i · δ + misfit_i)² - N · δ, with N the
force at O of load and tensions.

Within limits of f (or with a cone) g, δ and F_s still follow their stiffness: they are passive, and for given tensions
the energy above has one minimum. Inserted, they are affine in f (:meth:`AffineState.following`), which leaves

    minimise |Nᵀ f|²   subject to   M' f = m',   lower <= f <= upper,   F_s(f) in the cone

with the orthonormal columns of N the tensions that balance themselves at constant g: a convex quadratic program, solved
by :func:`exo_pin.numerics.solve` and certified by its optimality conditions. Where no limit is met its answer is the
one without limits. It is solved until the geometry of the program is the one its forces lead to. A limb at its limit
holds that force; the other tensions carry the rest, and the side forces follow. Where the others cannot carry it, the
actuators do not hold the pose: it is infeasible. Limits of locked actuators are checked and not chosen within: the
force in a lock is a reaction.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np
import scipy
from numpy.typing import NDArray

from ..core.errors import InvalidInput, SolverFailed
from ..core.errors.checked import checked
from ..core.progress import track
from ..core.records import Record
from ..core.validation import FloatArray, as_choice
from ..design import Mechanism
from ..design.shoulder import nothing_gives_way
from ..load_case.pose_stacks import Query
from ..numerics.vectors import NEAR_MARGIN, SINGULAR_MARGIN
from ..wrist.forces.affine_state import BalancedTensions, EquilibriumParts
from ..wrist.forces.displaced import Displaced, MovedDevice
from ..wrist.forces.elastic_equilibrium import ArmLoads, ElasticEquations, settle
from ..wrist.forces.side_forces import guide_flexibility
from ..wrist.limbs import STATUS
from .answer import QUERY_STATUS, answered
from .holding.infeasible_poses import is_held, shortfall
from .splits.limb_and_side_forces import PoseProgram, choose
from .splits.pose_stack import Moved, PoseStack
from .splits.split import Chosen, Spherical, Split


@checked
class Elastic(Split):
    """By stiffness of the limbs' guides, their joints, the shoulder, harness and cuff, at the displaced geometry.

    Parameters
    ----------
    actuators : {"held", "locked"}
        Whether the actuators hold the pose or their lengths.
    """

    name = "elastic"
    assumption = "the stiffness of guides, joints and shoulder, at the displaced geometry"
    criterion = "tensions that balance themselves of least sum of squares"
    options = frozenset({"cone"})
    determines_sides = True
    moves = True

    def __init__(self, actuators: Literal["held", "locked"] = "held") -> None:
        self.locked = as_choice("actuators", actuators, ("held", "locked")) == "locked"
        if self.locked:
            self.name = "elastic_locked"  # type: ignore[misc]
            self.assumption = (  # type: ignore[misc]
                "the stiffness of guides, joints and shoulder, at the displaced geometry and with the limbs' lengths "
                "locked"
            )
            self.options = frozenset()  # type: ignore[misc]
            self.refusals = {"cone": _REFUSED}  # type: ignore[misc]
            self.chooses_tensions = False

    def check(self, mechanism: Mechanism) -> None:
        """Raise if nothing gives way, or locked limbs are more than the freedoms of what does."""
        rigid = mechanism.shoulder.stiffness is None and mechanism.interfaces.are_rigid
        if rigid and not (guide_flexibility(mechanism)[1] & mechanism.is_upu).any():
            raise nothing_gives_way(mechanism.name)
        most, words = (3, "three") if rigid else (6, "six")
        if self.locked and mechanism.limb_count > most:
            raise InvalidInput(
                f"expected at most {words} limbs with locked actuators, got {mechanism.limb_count}: a device with "
                f'{words} freedoms cannot have more given lengths. split="elastic" lets the actuators adapt'
            )

    def caption(self, mechanism: Mechanism) -> str:
        """The assumption in a few words."""
        return "determined by stiffness"

    def program(self, poses: PoseStack, row: int) -> PoseProgram:
        """The least tensions within their limits, with side forces that follow them."""
        program = poses.program(row)
        poses.flexibility(np.array([row]))  # raises where a direction is free
        follower = program.state.following(poses.mechanism.shoulder.stiffness, poses.stiffness[row], poses.misfit[row])
        # Where side forces load the tensions, those of least norm are not those with the least part that balances
        # itself.
        stress, loaded = poses.tensions.self_stress[row].T, program.state.moment_of_g.any()
        metric = stress if len(stress) > 0 and loaded else None
        return program._replace(state=follower.state, follower=follower, metric=metric)

    def plain(self, poses: PoseStack, rows: NDArray[np.intp]) -> tuple[FloatArray, FloatArray]:
        """The forces of the equilibrium; NaN where a direction has no stiffness."""
        if not self.locked:
            part = BalancedTensions(*(array[rows] for array in poses.tensions))
            stiffness = poses.mechanism.shoulder.stiffness
            g, _ = part.elastic(poses.state.shoulder_of_g[rows], stiffness, poses.stiffness[rows], poses.misfit[rows])
            return part.f + (part.f_of_g @ g[..., None])[..., 0], g
        assert poses.moved is not None
        parts = poses.moved.parts
        assert parts.forces is not None
        delta = parts.displacement[rows]
        stretch = (np.swapaxes(poses.state.shoulder_of_g[rows], 1, 2) @ delta[..., None])[..., 0] + poses.misfit[rows]
        return parts.forces[rows], poses.stiffness[rows] * stretch

    def choose(self, poses: PoseStack, rows: NDArray[np.intp], answer: Chosen) -> None:
        """The forces of the equilibrium; of tensions that balance themselves, those of least norm."""
        answer.put_determined(rows, *self.plain(poses, rows))
        answer.status[rows[np.isnan(answer.g[rows]).any(axis=1)]] = STATUS.index("not_solved")

    def judge(self, poses: PoseStack, rows: NDArray[np.intp], answer: Chosen) -> None:
        """Mark poses in which locked limbs are, or nearly are, loaded by forces that balance themselves.

        The measure is the smallest singular value of the limbs' wrenches per N of tension, moments over the largest
        |B_i|. At zero their lengths leave a tension undetermined: no stiffness of the limbs themselves is known.
        """
        if not self.locked or not rows.size:
            return
        wrenches = poses.state.closure_of_f[rows] / np.repeat([1.0, poses.mechanism.radius], 3)
        margin = np.linalg.svd(wrenches, compute_uv=False)[:, -1]
        near = margin < NEAR_MARGIN
        answer.status[rows[near]] = np.maximum(answer.status[rows[near]], STATUS.index("near_singular"))
        answer.status[rows[margin < SINGULAR_MARGIN]] = STATUS.index("singular")

    def extras(self, poses: PoseStack, answer: Chosen) -> dict[str, FloatArray]:
        """Displacements, poses along the first axis."""
        delta = np.full((len(answer.f), 3), np.nan)
        rows = np.flatnonzero(answer.status < STATUS.index("singular"))
        stress = np.swapaxes(poses.tensions.self_stress[rows], 1, 2) @ answer.f[rows][..., None]
        load = poses.elastic_load(rows) - (poses.tensions.shoulder_of_stress[rows] @ stress)[..., 0]
        delta[rows] = (poses.flexibility(rows) @ load[..., None])[..., 0]
        assert poses.moved is not None
        moved, found = poses.moved.parts, {"centre_displacement": delta, "side_stiffness": poses.stiffness}
        lost = answer.status >= STATUS.index("singular")
        if self.locked:
            found["centre_displacement"] = moved.displacement.copy()
        found |= {
            "arm_orientation": moved.arm.copy(),
            "interface_displacements": np.stack([moved.harness, moved.cuff], axis=1),
            "limb_lengths": moved.lengths.copy(),
            "guide_twist": moved.twist.copy(),
            "guide_bending": moved.bending.copy(),
        }
        for name, array in found.items():
            if name != "side_stiffness":
                array[lost] = np.nan
        # A pose with an overloaded guide has an equilibrium, and a guide load; other poses without an answer have none.
        none = lost & (answer.status != QUERY_STATUS.index("guide_overloaded"))
        guide_load = np.where(none[:, None], np.nan, poses.moved.guide_load)
        return found | {"load_share": poses.moved.load_share, "guide_load": guide_load}


class DeviceElastic(Spherical):
    """Efforts and displacements are those of :mod:`exo_pin.device.elastic.soft_equations`.

    Parameters
    ----------
    name : {"elastic", "elastic_locked"}
        The pose is held, or the drives' coordinates in it (:mod:`exo_pin.device.elastic.soft_equilibrium`).
    """

    name = "elastic"
    assumption = "the stiffness of what gives way, at the displaced geometry"
    criterion = "efforts that balance themselves of least sum of squares"
    options = frozenset()
    determines_sides = True
    moves = True

    def __init__(self, name: str = "elastic") -> None:
        if name == "elastic_locked":
            self.name = name  # type: ignore[misc]
            self.assumption = f"{self.assumption} and with the drives locked"  # type: ignore[misc]
            self.chooses_tensions = False

    def assumed(self, mechanism: Mechanism) -> str:
        """The assumption in words."""
        return self.assumption

    def caption(self, mechanism: Mechanism) -> str:
        """The assumption in a few words."""
        return "determined by stiffness"

    def extras(self, poses: PoseStack, answer: Chosen) -> dict[str, FloatArray]:
        """Displacements of harness, cuff and shoulder, and the share of the load that has an equilibrium."""
        assert poses.placed is not None
        moved = poses.placed.moved
        assert moved is not None
        turned = {} if self.chooses_tensions else {"arm_orientation": moved.arm}
        return turned | {
            "interface_displacements": moved.interfaces,
            "load_share": moved.share,
            "centre_displacement": moved.centre,
        }


_REFUSED = (
    "a cone cannot go with locked actuators: their forces follow from the lengths and cannot be chosen. Use "
    'split="elastic", whose actuators adapt within their limits'
)


#: Largest displacement of the centre that counts as near, m: no shoulder joint opens that far.
_NEAR = 0.1
#: Largest difference between the geometry of a program and the geometry that its forces lead to, m and rad.
_SAME = 1e-9
#: Shares of the way to the geometry that the forces lead to, and how many such steps come before another search.
_RELAXED = ((0.5, 20), (0.25, 40), (0.1, 100))


class ElasticPoses(Record):
    """N poses of an elastic device.

    Parameters
    ----------
    split : Elastic
        With held or locked actuators.
    mechanism : Mechanism
        The design.
    query : Query
        N poses.
    offset : tuple of ndarray or None
        Centre offsets of base and cuff, shape (N, 3), m.
    loads : callable
        Of the arm; see :data:`exo_pin.wrist.forces.elastic_equilibrium.ArmLoads`.

    Attributes
    ----------
    status : ndarray of int8
        Shape (N,), index into :data:`exo_pin.reaction.answer.QUERY_STATUS`.
    device : MovedDevice
        At the equilibrium; in rows without one, in the given pose.
    """

    def __init__(
        self,
        split: Elastic,
        mechanism: Mechanism,
        query: Query,
        offset: tuple[FloatArray, FloatArray] | None,
        loads: ArmLoads,
    ) -> None:
        self.split, self.mechanism = split, mechanism
        self.stiffness = mechanism.shoulder.stiffness
        base, cuff = offset or (np.zeros((len(query.matrices), 3)),) * 2
        every = np.arange(len(base))
        self.equations = ElasticEquations(mechanism, query, base, cuff, loads, self.stiffness, split.locked)
        self.unmoved = Displaced(mechanism, query, base, cuff, *loads(every, query.matrices)[:2])
        self.status: NDArray[np.int8] = self.unmoved.status.copy()
        self.x, self.reached = settle(self.equations, answered(self.status))
        self._move()
        near = np.linalg.norm(self.equations.centre(self.x), axis=1) <= _NEAR
        lost = answered(self.status)[~((self.reached >= 1.0) & near)[answered(self.status)]]
        self.status[lost] = QUERY_STATUS.index("no_equilibrium")

    def _move(self) -> None:
        """Move the device to the unknowns x."""
        self.device = MovedDevice(self.equations, np.arange(len(self.x)), self.x)
        rows = answered(self.status)
        unstable = np.isnan(self.device.movement.bending[rows]).any(axis=1)
        self.status[rows[unstable]] = QUERY_STATUS.index("no_equilibrium")
        rows = rows[~unstable]
        # Moved, a pose may come nearer to the singular surface, but not onto it: no path of finite forces leads there.
        self.status[rows] = np.maximum(self.status[rows], np.minimum(self.device.displaced.status[rows], 1))

    @property
    def parts(self) -> EquilibriumParts:
        """Parts of the equilibrium as of :class:`Displaced`; without one the margin is NaN."""
        own, none = self.device.displaced, self.status == QUERY_STATUS.index("no_equilibrium")
        classified = (self.status, np.where(none, np.nan, own.margin), own.determinant)
        return own.state, own.tensions, own.side.stiffness, self.device.misfit, *classified

    @property
    def loads(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Loads of the displaced arm."""
        return self.device.loads

    def lengths(self) -> FloatArray:
        """Lengths of the limbs, shape (N, n), m."""
        return self.device.movement.lengths

    def within_limits(self, poses: PoseStack, progress: bool = False) -> PoseStack:
        """The poses at their equilibrium within limits and cone, and how the device moved to it."""
        infeasible = np.zeros(len(self.status), dtype=bool)
        rows = self._to_limit(poses)
        for row in track(rows.tolist(), "elastic limits", progress):
            try:
                infeasible[row] = not self._limit(poses, row)
            except (SolverFailed, np.linalg.LinAlgError):
                # Not found is not infeasible.
                self.status[row] = QUERY_STATUS.index("not_solved")
        if rows.size:
            self._move()
        load, rows = self._guide_load(), answered(self.status)
        with np.errstate(invalid="ignore"):
            over = (load > 1.0).any(axis=1)
        self.status[rows[np.asarray(over)[rows]]] = QUERY_STATUS.index("guide_overloaded")
        own = (self.device.movement, self.unmoved.tensions.shoulder, self.reached, load, infeasible)
        return _moved(poses, self.device)._replace(moved=Moved(*own))

    def _to_limit(self, poses: PoseStack) -> NDArray[np.intp]:
        """Rows whose tensions can be chosen and have to be, because those without limits do not meet them."""
        rows = answered(self.status)
        if self.split.locked or (poses.socket is None and self.mechanism.limb_count == 3):
            return rows[:0]
        rows = rows[poses.limits.reachable[rows]]
        if poses.socket is not None:
            return rows
        f, _ = self.split.plain(_moved(poses, self.device), rows)
        return rows[~poses.limits.met(f, rows)]

    def _limit(self, poses: PoseStack, row: int) -> bool:
        """Move one pose to the geometry to which the forces within its limits lead; return whether they hold it.

        Raises
        ------
        SolverFailed, LinAlgError
            If that geometry was not found.
        """
        start, scale = self.x[row].copy(), self.equations.scale

        def apart(y: FloatArray) -> FloatArray:
            return np.asarray((self._led_to(poses, row, y * scale) - y * scale) / scale)

        if np.abs(apart(start / scale) * scale).max() <= _SAME:
            return is_held(self._program(poses, row, start)[0])
        x = _fixed_point(apart, start / scale, scale) * scale
        held = is_held(self._program(poses, row, x)[0])
        if held:
            self.x[row] = x
        return held

    def _program(self, poses: PoseStack, row: int, x: FloatArray) -> tuple[PoseProgram, MovedDevice]:
        """The program of one pose at the unknowns x, and the device there."""
        device = MovedDevice(self.equations, np.array([row]), x[None])
        socket = None if poses.socket is None else poses.socket._replace(N=poses.socket.N[[row]])
        moved = _moved(poses, device)._replace(limits=poses.limits.rows(np.array([row])), socket=socket)
        return self.split.program(moved, 0), device

    def _led_to(self, poses: PoseStack, row: int, x: FloatArray) -> FloatArray:
        """Unknowns that follow from the forces that the program chooses at the unknowns x, or from the closest ones."""
        program, device = self._program(poses, row, x)
        own, missing = device.displaced, shortfall(program)
        f = choose(program).f if missing is None else missing.f
        assert program.follower is not None
        g = program.follower.g + program.follower.g_of_f @ f
        state = own.state.row(0)
        S, k = state.shoulder_of_g, own.side.stiffness[0]
        force = state.shoulder + state.shoulder_of_f @ f + S @ (k * device.misfit[0])
        delta = np.zeros(3) if self.stiffness is None else -np.linalg.solve(self.stiffness + (S * k) @ S.T, force)
        closure = state.closures(f, g)
        on_arm = (closure - state.limb_share).sum(axis=0)
        return self.equations.led_to(x, row, delta, -closure.sum(axis=0), on_arm + device.loads[2][0])

    def _guide_load(self) -> FloatArray:
        """The larger of bending moment and torque of each guide over its limit, shape (N, n); NaN if none is known."""
        side = self.device.displaced.side
        g = np.abs(side.stiffness * side.deflection)
        limits = np.full((2, self.mechanism.limb_count), np.nan)
        for i, limb in enumerate(self.mechanism.limbs):
            if limb.guide is not None:
                own = (limb.guide.largest_bending_moment, limb.guide.largest_torque)
                limits[:, i] = [np.nan if value is None else value for value in own]
        return np.asarray(np.fmax(g * side.bending / limits[0], g * np.abs(side.torque) / limits[1]))


def _fixed_point(apart: Callable[[FloatArray], FloatArray], start: FloatArray, scale: FloatArray) -> FloatArray:
    """Zero of ``apart``, which has kinks where a tension meets its limit: a search may stop at one.

    It then starts anew from a point that small steps along ``apart`` lead to.

    Raises
    ------
    SolverFailed
        If none was found.
    """
    miss = np.inf
    for share, steps in ((0.0, 0), *_RELAXED):
        near = start
        for _ in range(steps):
            near = near + share * apart(near)
        found = scipy.optimize.root(apart, near, method="hybr", options={"xtol": 1e-13}).x
        miss = float(np.abs(apart(found) * scale).max())
        if miss <= _SAME:
            return np.asarray(found)
    raise SolverFailed("hybr", miss, "elastic device within its limits")


def _moved(poses: PoseStack, device: MovedDevice) -> PoseStack:
    """Poses in the equilibrium of a moved device."""
    own = device.displaced
    return poses._replace(state=own.state, tensions=own.tensions, stiffness=own.side.stiffness, misfit=device.misfit)
