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

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.validation import FloatArray, as_choice
from ...design import Mechanism
from ...design.shoulder import nothing_gives_way
from ...numerics.vectors import NEAR_MARGIN, SINGULAR_MARGIN
from ...wrist.forces.affine_state import BalancedTensions
from ...wrist.forces.side_forces import guide_flexibility
from ...wrist.limbs import STATUS
from ..answer import QUERY_STATUS
from .limb_and_side_forces import Pose
from .pose_stack import PoseStack
from .split import Chosen, Spherical, Split


def require_what_gives_way(mechanism: Mechanism) -> None:
    """Raise if no part of a wrist has a stiffness.

    What has none is rigid: shoulder, harness, cuff. A limb without a guide carries no side force.

    Raises
    ------
    MissingData
        If nothing gives way.
    """
    guides = bool((guide_flexibility(mechanism)[1] & mechanism.is_upu).any())
    if mechanism.shoulder.stiffness is None and mechanism.interfaces.are_rigid and not guides:
        raise nothing_gives_way(mechanism.name)


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
        require_what_gives_way(mechanism)
        rigid = mechanism.shoulder.stiffness is None and mechanism.interfaces.are_rigid
        most, words = (3, "three") if rigid else (6, "six")
        if self.locked and mechanism.limb_count > most:
            raise InvalidInput(
                f"expected at most {words} limbs with locked actuators, got {mechanism.limb_count}: a device with "
                f'{words} freedoms cannot have more given lengths. split="elastic" lets the actuators adapt'
            )

    def caption(self, mechanism: Mechanism) -> str:
        """The assumption in a few words."""
        return "determined by stiffness"

    def program(self, poses: PoseStack, row: int) -> Pose:
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
            g, _ = part.elastic(poses.sides[rows], stiffness, poses.stiffness[rows], poses.misfit[rows])
            return part.f + (part.f_of_g @ g[..., None])[..., 0], g
        assert poses.moved is not None
        parts = poses.moved.parts
        assert parts.forces is not None
        delta = parts.displacement[rows]
        stretch = (np.swapaxes(poses.sides[rows], 1, 2) @ delta[..., None])[..., 0] + poses.misfit[rows]
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
