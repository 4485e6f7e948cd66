"""Moment balance of humerus, forearm and radius: what the muscles have to hold in a stack of poses.

With the scapula held, the whole arm is in equilibrium about the glenohumeral centre (three equations), ulna, radius and
hand about the axis of elbow flexion, and radius and hand about the forearm's axis:

    Σ_j T_j m_j + M = 0,      Σ_j T_j e_j + M_e = 0,      Σ_j T_j p_j = 0.

The force balance of the arm then gives the contact force, F = -(Σ_j T_j u_j + F_ext). Assumptions:

* The contact is without friction and acts at the glenohumeral centre: no moment.
* Forearm, hand and payload lie on the forearm's axis: no moment about it.
* Wrist and fingers are rigid.
* A motion is that of a rigid arm about the centre; the acceleration of the centre itself is left out.
* The scapula is held by muscles that are not in the model. Its equilibrium is not computed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...core.validation import FloatArray
from ...load_case.pose_stacks import Query, carried
from ..limb.limb_state import LimbGeometry
from ..limb.muscle_table import MuscleState

if TYPE_CHECKING:
    from ..wearer import Person


class ExternalLoads(NamedTuple):
    """What acts on the person's arm besides muscles and joint, of N poses, in {O_A}.

    Attributes
    ----------
    force, moment : ndarray
        Shape (N, 3), N and N m about the glenohumeral centre: weight, inertia and loads.
    elbow : ndarray
        Moment on forearm and hand about the axis of elbow flexion, shape (N,), N m.
    """

    force: FloatArray
    moment: FloatArray
    elbow: FloatArray


class Balance(NamedTuple):
    """Balance of N poses, linear in the activations a: ``rows @ a = -(constant)`` and contact = ``pull @ a + rest``.

    Attributes
    ----------
    rows : ndarray
        Moments per activation, shape (N, 5, m), N m: three about the centre, elbow flexion, forearm.
    constant : ndarray
        Moments of all that does not depend on the activations, shape (N, 5), N m.
    pull : ndarray
        Contact force per activation, shape (N, 3, m), N: of the scapula on the humerus.
    rest : ndarray
        Contact force without activation, shape (N, 3), N.
    """

    rows: FloatArray
    constant: FloatArray
    pull: FloatArray
    rest: FloatArray


def external_loads(
    person: Person, axis: FloatArray, gravity: FloatArray, query: Query, on_forearm: bool
) -> ExternalLoads:
    """Weight, inertia and load.

    Parameters
    ----------
    person : Person
        Whose arm it is.
    axis : ndarray
        Axis of elbow flexion, shape (N, 3), in {O_A}.
    gravity : ndarray
        Shape (3,), m/s².
    query : Query
        Poses, motion and load.
    on_forearm : bool
        Whether the load acts on the forearm or hand, so that the elbow has to carry it.
    """
    force, moment = carried(person.arm, gravity, query, query.force, query.moment)
    nothing = np.zeros_like(query.force)
    loaded = (query.force, query.moment) if on_forearm else (nothing, nothing)
    below, about_centre = carried(person.forearm, gravity, query, *loaded)
    about_elbow = about_centre - np.cross(query.matrices @ person.elbow_centre, below)
    return ExternalLoads(force, moment, np.einsum("ni,ni->n", axis, about_elbow))


def about_shifted_centre(
    limb: LimbGeometry, loads: ExternalLoads, shift: FloatArray
) -> tuple[LimbGeometry, ExternalLoads]:
    """Moments about a centre of the joint that is displaced by ``shift``, shape (3,), m, against bones and muscles."""
    if not shift.any():
        return limb, loads
    return (
        limb._replace(moment=limb.moment - np.cross(shift, limb.pull)),
        loads._replace(moment=loads.moment - np.cross(shift, loads.force)),
    )


def balance_of(limb: LimbGeometry, muscles: MuscleState, loads: ExternalLoads) -> Balance:
    """Put muscles and loads together."""
    arms = np.concatenate([np.swapaxes(limb.moment, 1, 2), limb.elbow[:, None, :], limb.forearm[:, None, :]], axis=1)
    outer = np.concatenate([loads.moment, loads.elbow[:, None], np.zeros((len(loads.elbow), 1))], axis=1)
    pulls = np.swapaxes(limb.pull, 1, 2)
    return Balance(
        arms * muscles.active[:, None, :],
        outer + np.einsum("nkm,nm->nk", arms, muscles.passive),
        -pulls * muscles.active[:, None, :],
        -(loads.force + np.einsum("nkm,nm->nk", pulls, muscles.passive)),
    )
