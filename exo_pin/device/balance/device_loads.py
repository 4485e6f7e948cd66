"""The equations of motion of a device in a stack of poses: its closed chain, and what drives, springs and loads do."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...chain.dynamics.equations.equation_stacks import EquationsStack, equations_of_stack
from ...chain.kinematics.loops import constraint_drift
from ...core.validation import FloatArray
from ...load_case.pose_stacks import Query
from ..device_model import DeviceModel
from ..parts.lacking_data import LackingData
from ..parts.routes import PlacedRoute
from ..postures import following

__all__ = ["device_loads"]


class Driven(NamedTuple):
    """What the drives do in N poses; springs and loads are no part of it.

    Attributes
    ----------
    B : ndarray
        Generalised force on the free tree for an effort of one, shape (N, nv, efforts).
    pulls : list of ndarray or None
        Wrenches of a tension of 1 N of each routed drive on the bodies, shape (N, njoints, 6); None of the others.
    coordinates : ndarray
        Shape (N, efforts), m or rad.
    lacking : dict of int to tuple of LackingData
        By the pose, routed drives without a direction there, whose columns are zero.
    """

    B: FloatArray
    pulls: list[FloatArray | None]
    coordinates: FloatArray
    lacking: dict[int, tuple[LackingData, ...]]


class DeviceLoads(NamedTuple):
    """The equations of N poses; a spring without data for a pose gives no force there.

    Attributes
    ----------
    equations : EquationsStack
        Of the chain in the tree whose arm flies free.
    tau : ndarray
        Shape (N, nv), the left side: forces of that tree minus those of springs and load.
    driven : Driven
        What the drives do.
    rates : ndarray
        Of their coordinates, shape (N, efforts); zero at rest.
    spring_pulls : list of ndarray or None
        Wrenches of each routed spring on the bodies, shape (N, njoints, 6); None of the others.
    lacking : dict of int to tuple of LackingData
        By the pose, drives and springs whose data do not cover it.
    data_margin : ndarray
        Of the springs, shape (N,), as of :meth:`.DeviceModel.spring_forces`.
    """

    equations: EquationsStack
    tau: FloatArray
    driven: Driven
    rates: FloatArray
    spring_pulls: list[FloatArray | None]
    lacking: dict[int, tuple[LackingData, ...]]
    data_margin: FloatArray


def driven_by(model: DeviceModel, q: FloatArray, equations: EquationsStack) -> Driven:
    """What the drives do, for configurations of the free tree, shape (N, nq)."""
    count, poses = len(q), equations.poses
    B, coordinates = np.zeros((count, model.free.nv, len(model.drives))), np.empty((count, len(model.drives)))
    pulls: list[FloatArray | None] = [None] * len(model.drives)
    lacking = dict[int, tuple[LackingData, ...]]()
    for i, (drive, place) in enumerate(model.drives):
        coordinates[:, i] = drive.zero_length + model.coordinate(place, q, poses)
        if not isinstance(place, PlacedRoute):
            B[:, place, i] = -1.0 if drive.pulls else 1.0
            continue
        aims = place.has_direction(poses)
        for k in np.flatnonzero(~aims).tolist():
            lacking[k] = (*lacking.get(k, ()), LackingData("drive", drive.name))
        pulls[i] = pull = np.zeros((count, *equations.tree.shape[1:]))
        pull[aims] = place.wrenches(poses[aims])
        B[:, :, i] = _generalised(model, equations, pull)
    return Driven(B, pulls, coordinates, lacking)


def _generalised(model: DeviceModel, equations: EquationsStack, wrenches: FloatArray) -> FloatArray:
    """Generalised forces of wrenches on the bodies, about the world's origin, shape (N, nv)."""
    return np.asarray(np.einsum("nci,nci->nc", equations.J, (model.carried @ wrenches)[:, model.owners]))


def device_loads(model: DeviceModel, q: FloatArray, query: Query) -> DeviceLoads:
    """The equations at configurations and the motion of N poses.

    Parameters
    ----------
    model : DeviceModel
        The device.
    q : ndarray
        Closed configurations of the held tree, shape (N, nq).
    query : Query
        Poses, motion and load.
    """
    v, a = _motions(model, q, query)
    own = model.free_configuration(q)
    free = (None if part is None else model.free_motion(part) for part in (v, a))
    equations = equations_of_stack(model.free, own, *free)
    driven = driven_by(model, own, equations)
    rates = np.zeros(driven.coordinates.shape)
    if v is not None:
        rates = np.einsum("nci,nc->ni", driven.B, model.free_motion(v))
    tau = equations.tau.copy()
    forces, lacking, margin = model.spring_forces(own, equations.poses)
    pulls: list[FloatArray | None] = [None] * len(model.springs)
    for i, (_, place) in enumerate(model.springs):
        if not isinstance(place, PlacedRoute):
            tau[:, place] += forces[:, i]
            continue
        pulls[i] = pull = np.zeros((len(q), *equations.tree.shape[1:]))
        acts = forces[:, i] != 0.0
        pull[acts] = forces[acts, i, None, None] * place.wrenches(equations.poses[acts])
        tau -= _generalised(model, equations, pull)
    # The load acts on the arm, in whose axes its rows are; its moment is about O, where the arm's joint is.
    for rows, load in ((model.linear, query.force), (model.angular, query.moment)):
        tau[:, rows] -= np.einsum("nij,ni->nj", query.matrices, load)
    every = {k: (*driven.lacking.get(k, ()), *lacking.get(k, ())) for k in {*driven.lacking, *lacking}}
    return DeviceLoads(equations, tau, driven, rates, pulls, every, margin)


def _motions(model: DeviceModel, q: FloatArray, query: Query) -> tuple[FloatArray | None, FloatArray | None]:
    """Velocities and accelerations of the held tree, shape (N, nv); None at rest."""
    turn, push = (np.einsum("nij,ni->nj", query.matrices, part) for part in (query.velocity, query.acceleration))
    moving = turn.any(axis=1) | push.any(axis=1)
    if not moving.any():
        return None, None
    v, a = np.zeros((2, len(q), model.held.nv))
    for k in np.flatnonzero(moving):
        v[k] = following(model, q[k], turn[k])
        a[k] = following(model, q[k], push[k], constraint_drift(model.held, q[k], v[k]))
    return v, a
