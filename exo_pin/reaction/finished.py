"""From the arrays of an answer to the record: shaped to the caller's stack, and checked for balance."""

from __future__ import annotations

from functools import partial

import numpy as np

from ..core.validation import FloatArray
from ..load_case.pose_stacks import Query
from ..wrist.forces.closed_form import STATUS
from .answer import QUERY_STATUS, STANDARD_GRAVITY, Answer, Wanted
from .indeterminacy.certificate import Certificate
from .indeterminacy.component_assumptions import ComponentSource
from .indeterminacy.infeasibility import Infeasibility
from .mechanism_loads import arm_loads
from .result import Optimum, Reaction

__all__ = ["finished"]

_CHOSEN_BY = {
    "spherical": "limbs that carry no side force (g = 0)",
    "minimal": "the side forces within their bounds that make the shoulder force least",
    "standalone": "a shoulder that carries nothing (F_s = 0)",
    "elastic": "the stiffness of guides, joints and shoulder, for displacements small against the limbs",
}


def finished(
    answer: Answer, query: Query, wanted: Wanted, offset: tuple[FloatArray, FloatArray] | None = None
) -> Reaction:
    """The record of an answer whose poses are filled, at centre offsets of base and cuff, shape (N, 3) each, m."""
    split = wanted.split
    answer.refuse_what_is_not_finite()
    answered = answer.status < STATUS.index("singular")
    arm = answer.mechanism.arm
    weight = None
    if arm is not None and arm.body_mass is not None:
        weight = arm.body_mass * STANDARD_GRAVITY

    stacked = partial(_stacked, query.shape)
    arm_force, arm_moment, device = arm_loads(answer.mechanism, query)
    limbs = answer.on_arm.sum(axis=1)
    largest = np.maximum(
        np.abs(answer.shoulder).max(axis=1), np.abs(answer.on_arm[:, :, :3]).max(axis=(1, 2), initial=0.0)
    )
    largest = np.maximum(largest, np.abs(arm_force).max(axis=1))
    return Reaction(
        shoulder_force=stacked(answer.shoulder),
        actuator_forces=stacked(answer.f),
        constraint_forces=stacked(answer.g),
        limb_wrenches=stacked(answer.on_arm),
        cuff_wrench=stacked(limbs + device),
        harness_wrenches=stacked(answer.on_torso),
        spherical_force=stacked(answer.spherical),
        ratio=stacked(_ratio(answer, largest)),
        split=split,
        status=np.array(QUERY_STATUS)[answer.status].reshape(query.shape),
        margin=stacked(answer.margin),
        determinant=stacked(answer.determinant),
        residual=stacked(_residual(answer, limbs, arm_force, arm_moment, largest)),
        certificate=_certificate(answer, query, wanted, offset),
        body_weight=weight,
        trivial=split == "minimal" and bool(answered.any() and answer.trivial[answered].all()),
        optimum=Optimum(stacked(answer.kkt), stacked(answer.gap), stacked(answer.unique)),
        infeasibility=(
            Infeasibility.from_rows(query.shape, answer.mechanism.limb_count, answer.shortfalls)
            if answer.shortfalls
            else None
        ),
        centre_displacement=None if answer.displacement is None else stacked(answer.displacement),
        side_stiffness=None if answer.stiffness is None else stacked(answer.stiffness),
    )


def _stacked(shape: tuple[int, ...], array: np.ndarray) -> np.ndarray:
    """Poses along the first axis to the caller's stack."""
    return array.reshape((*shape, *array.shape[1:]))


def _residual(
    answer: Answer, limbs: FloatArray, arm_force: FloatArray, arm_moment: FloatArray, largest: FloatArray
) -> FloatArray:
    """What force and moment balance of the arm miss, relative to the largest force, shape (N,)."""
    miss = np.maximum(
        np.abs(answer.shoulder + limbs[:, :3] + arm_force).max(axis=1),
        np.abs(limbs[:, 3:] + arm_moment).max(axis=1) / answer.radius,
    )
    return np.divide(miss, largest, out=np.where(np.isnan(miss), np.nan, 0.0), where=largest > 0.0)


def _ratio(answer: Answer, largest: FloatArray) -> FloatArray:
    """Γ of (D-34), shape (N,); NaN where both forces vanish against the largest.

    Source: thesis (D-34).
    """
    size, reference = np.linalg.norm(answer.shoulder, axis=1), np.linalg.norm(answer.spherical, axis=1)
    nothing = 1e-12 * largest
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(reference > nothing, size / reference, np.where(size > nothing, np.inf, np.nan))
    ratio[np.isnan(size)] = np.nan
    return np.asarray(ratio)


def _certificate(
    answer: Answer, query: Query, wanted: Wanted, offset: tuple[FloatArray, FloatArray] | None
) -> Certificate:
    """What equilibrium determines; its components' kinds and intervals are worked out when they are asked for."""
    base, cuff = offset if offset is not None else (np.zeros((len(answer.f), 3)),) * 2
    if wanted.split == "standalone" and offset is not None:
        base = np.einsum("kij,kj->ki", query.matrices, cuff)
    values = np.concatenate([answer.f, answer.g, answer.shoulder], axis=1)
    source = ComponentSource(answer.mechanism, query, base, cuff, wanted.split, wanted.side_bounds, values)
    stacked = partial(_stacked, query.shape)
    return Certificate(
        stacked(answer.undetermined),
        stacked(answer.redundant),
        stacked(answer.f_unique),
        stacked(answer.g_unique),
        stacked(answer.shoulder_unique),
        stacked(answer.torso_unique),
        _CHOSEN_BY[wanted.split]
        + ("" if wanted.limits.is_free else ", within the limits of the limbs")
        + ("" if wanted.cone is None else ", with regard to the socket"),
        source,
    )
