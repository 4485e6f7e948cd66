"""Split "elastic_linear": side forces and shoulder force by stiffness, in the limit of small displacements.

The ball joint is displaced by δ under its force, the guides of UPU limbs by g_i / k_i under theirs. With S_i the force
of the side wrench of limb i (X_i where the centres of device and shoulder coincide) and misfit_i the distance of the
centres along it,

    g_i = k_i (S_i · δ + misfit_i)          F_s = -K_s δ

For given tensions this is the δ of least strain energy ½ δᵀ K_s δ + ½ Σ k_i (S_i · δ + misfit_i)² - N · δ, with N the
force at O of load and tensions. δ is taken to be small against the limbs: lever arms and directions are those at δ = 0.
The actuators hold the arm in the given pose, so that tensions follow from the moment balance and not from a stiffness;
tensions that balance themselves are of least norm. Harness and cuff are rigid.
The split "elastic" (:mod:`exo_pin.reaction.splits.elastic`) solves the equilibrium at the displaced geometry.

Within limits of f (or with a cone) g, δ and F_s still follow their stiffness: they are passive, and for given tensions
the energy above has one minimum. Inserted, they are affine in f (:meth:`AffineState.following`), which leaves

    minimise |Nᵀ f|²   subject to   M' f = m',   lower <= f <= upper,   F_s(f) in the cone

with the orthonormal columns of N the tensions that balance themselves at constant g: a convex quadratic program, solved
by :func:`exo_pin.numerics.solve` and certified by its optimality conditions. Where no limit is met its answer is the
one without limits. A limb at its limit holds that force; the other tensions carry the rest, and the side forces
follow. Where the others cannot carry it, the actuators do not hold the pose: it is infeasible, and the arm would turn
to another pose, in which the guides carry the rest.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...core.errors import MissingData, SolverFailed
from ...core.validation import FloatArray
from ...design import Mechanism
from ...wrist.forces.affine_state import LOOSE, BalancedTensions
from ...wrist.limbs import STATUS
from ..indeterminacy.component_assumptions import Freedom
from .limb_and_side_forces import Pose
from .split import Chosen, PoseStack, Split

__all__ = ["ElasticLinear", "shoulder_stiffness"]


def shoulder_stiffness(mechanism: Mechanism) -> FloatArray:
    """K_s, shape (3, 3), N/m.

    Raises
    ------
    MissingData
        If the mechanism has none; no value was found in the literature, so nothing is assumed.
    """
    if mechanism.shoulder.stiffness is None:
        raise MissingData(["shoulder stiffness"], 'split="elastic"', mechanism.name)
    return mechanism.shoulder.stiffness


class ElasticLinear(Split):
    """By stiffness of the limbs' guides, their joints and the shoulder, for small displacements."""

    name = "elastic_linear"
    assumption = "the stiffness of guides, joints and shoulder, for displacements small against the limbs"
    criterion = "tensions that balance themselves of least sum of squares"
    options = frozenset({"cone"})
    determines_sides = True

    def caption(self, mechanism: Mechanism) -> str:
        """The assumption in a few words."""
        return "determined by stiffness"

    def check(self, mechanism: Mechanism) -> None:
        """Raise if the shoulder's stiffness is not known."""
        shoulder_stiffness(mechanism)

    def shoulder_stiffness(self, mechanism: Mechanism) -> FloatArray | None:
        """K_s, shape (3, 3), N/m."""
        return shoulder_stiffness(mechanism)

    def program(self, poses: PoseStack, row: int) -> Pose:
        """The least tensions within their limits, with side forces that follow them."""
        program, stiffness = poses.program(row), shoulder_stiffness(poses.mechanism)
        system, _ = poses.elastic_system(np.array([row]), stiffness)
        if not np.linalg.cond(system[0]) < LOOSE:
            raise SolverFailed("elastic split", np.inf, "shoulder and limbs together leave a direction free")
        follower = program.state.following(stiffness, poses.stiffness[row], poses.misfit[row])
        # Where side forces load the tensions, those of least norm are not those with the least part that balances
        # itself.
        stress, loaded = poses.tensions.self_stress[row].T, program.state.moment_of_g.any()
        metric = stress if len(stress) > 0 and loaded else None
        return program._replace(state=follower.state, follower=follower, metric=metric)

    def plain(self, poses: PoseStack, rows: NDArray[np.intp]) -> tuple[FloatArray, FloatArray]:
        """Solve the elastic equations; NaN where a direction has no stiffness."""
        part = BalancedTensions(*(array[rows] for array in poses.tensions))
        stiffness = shoulder_stiffness(poses.mechanism)
        g, _ = part.elastic(poses.sides[rows], stiffness, poses.stiffness[rows], poses.misfit[rows])
        return part.f + (part.f_of_g @ g[..., None])[..., 0], g

    def choose(self, poses: PoseStack, rows: NDArray[np.intp], answer: Chosen) -> None:
        """The forces of the equilibrium; of tensions that balance themselves, those of least norm."""
        answer.put_determined(rows, *self.plain(poses, rows))
        answer.status[rows[np.isnan(answer.g[rows]).any(axis=1)]] = STATUS.index("not_solved")

    def kinds(self, freedom: Freedom) -> NDArray[np.str_]:
        """Determined by stiffness, but for tensions that balance themselves."""
        effect = freedom.elastic(freedom.of_tensions)
        return np.where(freedom.is_fixed(effect), "stiffness", "optimiser")

    def extras(self, poses: PoseStack, answer: Chosen) -> dict[str, FloatArray]:
        """Displacement of the shoulder's centre, shape (N, 3), m, and stiffness of the limbs, shape (N, n), N/m."""
        delta = np.full((len(answer.f), 3), np.nan)
        rows = np.flatnonzero(answer.status < STATUS.index("singular"))
        system, load = poses.elastic_system(rows, shoulder_stiffness(poses.mechanism))
        stress = np.swapaxes(poses.tensions.self_stress[rows], 1, 2) @ answer.f[rows][..., None]
        load = load - (poses.tensions.shoulder_of_stress[rows] @ stress)[..., 0]
        delta[rows] = np.linalg.solve(system, load[..., None])[..., 0]
        return {"centre_displacement": delta, "side_stiffness": poses.stiffness}
