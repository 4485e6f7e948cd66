"""From chosen forces to the record: shaped to the caller's stack, and checked for balance."""

from __future__ import annotations

from functools import partial

import numpy as np

from ..core.validation import FloatArray
from ..load_case.pose_stacks import Query
from ..wrist.forces.affine_state import AffineState
from ..wrist.forces.closed_form import STATUS
from .answer import QUERY_STATUS, STANDARD_GRAVITY, answered
from .indeterminacy.certificate import Certificate, is_determined
from .indeterminacy.component_assumptions import ComponentSource
from .indeterminacy.infeasibility import Infeasibility, Shortfall
from .result import Optimum, Reaction
from .splits.split import Chosen, PoseStack, Split

__all__ = ["finished"]


def finished(
    split: Split,
    poses: PoseStack,
    query: Query,
    chosen: Chosen,
    missing: dict[int, Shortfall],
    margin: FloatArray,
    determinant: FloatArray,
    arm: tuple[FloatArray, FloatArray, FloatArray],
) -> Reaction:
    """The record of chosen forces; ``arm`` is what :func:`exo_pin.load_case.arm_loads.arm_loads` returns."""
    f, g = chosen.f, chosen.g
    state, owner = poses.state, poses.mechanism.arm
    closure = state.closures(f, g)
    shoulder, on_arm = state.shoulder_force(f, g), closure - state.limb_share
    spherical = poses.spherical_force.copy()
    spherical[chosen.status >= STATUS.index("singular")] = np.nan
    limbs = on_arm.sum(axis=1)
    largest = np.maximum(np.abs(shoulder).max(axis=1), np.abs(on_arm[:, :, :3]).max(axis=(1, 2), initial=0.0))
    largest = np.maximum(largest, np.abs(arm[0]).max(axis=1))
    stacked = partial(_stacked, query.shape)
    rows = answered(chosen.status)
    return Reaction(
        shoulder_force=stacked(shoulder),
        actuator_forces=stacked(f),
        constraint_forces=stacked(g),
        limb_wrenches=stacked(on_arm),
        cuff_wrench=stacked(limbs + arm[2]),
        harness_wrenches=stacked(-closure),
        spherical_force=stacked(spherical),
        ratio=stacked(_ratio(shoulder, spherical, largest)),
        split=split.name,
        status=np.array(QUERY_STATUS)[chosen.status].reshape(query.shape),
        margin=stacked(margin),
        determinant=stacked(determinant),
        residual=stacked(_residual(shoulder + limbs[:, :3] + arm[0], limbs[:, 3:] + arm[1], poses.radius, largest)),
        certificate=_certificate(split, poses, query, chosen, shoulder),
        body_weight=None if owner is None or owner.body_mass is None else owner.body_mass * STANDARD_GRAVITY,
        trivial=bool(rows.size and chosen.trivial[rows].all()),
        optimum=Optimum(stacked(chosen.kkt), stacked(chosen.gap), stacked(chosen.unique)),
        infeasibility=Infeasibility.from_rows(query.shape, f.shape[1], missing) if missing else None,
        **{name: stacked(value) for name, value in split.extras(poses, chosen).items()},
    )


def _stacked(shape: tuple[int, ...], array: np.ndarray) -> np.ndarray:
    """Poses along the first axis to the caller's stack."""
    return array.reshape((*shape, *array.shape[1:]))


def _residual(force: FloatArray, moment: FloatArray, radius: float, largest: FloatArray) -> FloatArray:
    """What force and moment balance of the arm miss, relative to the largest force, shape (N,)."""
    miss = np.maximum(np.abs(force).max(axis=1), np.abs(moment).max(axis=1) / radius)
    return np.divide(miss, largest, out=np.where(np.isnan(miss), np.nan, 0.0), where=largest > 0.0)


def _ratio(shoulder: FloatArray, spherical: FloatArray, largest: FloatArray) -> FloatArray:
    """Γ of (D-34), shape (N,); NaN where both forces vanish against the largest.

    Source: thesis (D-34).
    """
    size, reference = np.linalg.norm(shoulder, axis=1), np.linalg.norm(spherical, axis=1)
    nothing = 1e-12 * largest
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(reference > nothing, size / reference, np.where(size > nothing, np.inf, np.nan))
    ratio[np.isnan(size)] = np.nan
    return np.asarray(ratio)


def _certificate(split: Split, poses: PoseStack, query: Query, chosen: Chosen, shoulder: FloatArray) -> Certificate:
    """Which reactions change with a self-stress, Wojtyra's criterion; their kinds and intervals are found on demand."""
    upu, own = poses.upu, poses.tensions
    n, stresses = own.self_stress.shape[1:]
    good = chosen.status < STATUS.index("singular")
    of_f = np.concatenate([own.self_stress, own.f_of_g[:, :, upu]], axis=2)
    of_shoulder = np.concatenate([own.shoulder_of_stress, own.shoulder_of_g[:, :, upu]], axis=2)
    g_unique = np.ones((len(good), n), dtype=bool)
    g_unique[:, upu] = False
    stacked = partial(_stacked, query.shape)
    return Certificate(
        stacked(np.where(good, stresses + upu.size, -1)),
        stacked(np.where(good, upu.size, -1)),
        stacked(is_determined(of_f) & good[:, None]),
        stacked(g_unique & good[:, None]),
        stacked(is_determined(of_shoulder) & good[:, None]),
        # Arm and torso are a closed system: what limbs and shoulder together put on the torso is fixed by the arm.
        stacked(good.copy()),
        split.assumption
        + ("" if poses.limits.is_free else ", within the limits of the limbs")
        + ("" if poses.socket is None else ", with regard to the socket"),
        ComponentSource(
            split,
            poses._replace(state=AffineState.empty(0, n)),
            query.shape,
            np.concatenate([chosen.f, chosen.g, shoulder], axis=1),
        ),
    )
