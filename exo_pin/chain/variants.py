"""New chains from a chain: one more loop closed, joints locked, a joint of another kind."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ..core.errors import InvalidInput
from ..core.validation import FloatArray, require_type
from .formats.bodies import rebuilt
from .structure.chain_state import CLOSED, ChainState
from .structure.closures import Closure
from .structure.description import Closures


def with_closure(state: ChainState, closure: Closure) -> Closures:
    """The description of a chain with one more closure, the last one.

    Raises
    ------
    InvalidInput
        If it is no closure, or there is one of this name.
    """
    require_type("closure", closure, Closure)
    return replace(state.description, closures=(*state.closures, closure))


def locked(state: ChainState, joints: Iterable[str], q: ArrayLike) -> tuple[pin.Model, Closures]:
    """A tree and its description with some joints locked; see :meth:`exo_pin.chain.ClosedChain.locked`."""
    q = state.configuration(q)
    indices = sorted({state.joint_index(name) for name in ([joints] if isinstance(joints, str) else joints)})
    names = {str(state.model.names[index]) for index in indices}
    if 0 in indices:
        raise InvalidInput("the world is no joint: expected joints that move")
    whole = state.model.copy()
    for index in indices:
        # Without a frame of its joints, which a model that was built in code may lack, Pinocchio crashes.
        if not whole.existFrame(whole.names[index], pin.FrameType.JOINT):
            whole.addJointFrame(index)
    model = pin.buildReducedModel(whole, indices, q)
    model.gravity = whole.gravity
    description = state.description
    root, roles = description.root, description.roles
    changed = replace(
        roles,
        actuated=tuple(name for name in roles.actuated if name not in names),
        shoulder=None if roles.shoulder in names else roles.shoulder,
        limbs=tuple(limb for limb in roles.limbs if not {limb.slide, limb.platform_joint} & names),
    )
    closures = (_held(state, closure, names, q) if closure.polynomial else closure for closure in state.closures)
    return model, replace(
        description,
        root=replace(root, joint="fixed") if root.name in names else root,
        closures=tuple(closure for closure in closures if closure is not None),
        roles=changed,
        joints=tuple(item for item in description.joints if item.joint not in names),
    )


def with_joint(
    state: ChainState,
    joint: int,
    kind: pin.JointModel,
    inertia: pin.Inertia | None = None,
    moved: Mapping[int, FloatArray] | None = None,
) -> pin.Model:
    """The tree with one joint of another kind; data of all others, and their frames, stay.

    Parameters
    ----------
    joint : int
        Index of the joint.
    kind : pinocchio.JointModel
        What it becomes.
    inertia : pinocchio.Inertia, optional
        Of the body that it carries; as it is if left out.
    moved : mapping, optional
        Shifts of joints, by index, shape (3,), m, in the axes of the body that carries them.
    """
    old, places = state.model, dict[int, pin.SE3]()
    for index, shift in (moved or {}).items():
        places[index] = pin.SE3(old.jointPlacements[index].rotation, old.jointPlacements[index].translation + shift)
    new = rebuilt(old, {joint: kind}, places)
    if inertia is not None:
        new.inertias[joint] = inertia
    return new


def _held(state: ChainState, closure: Closure, names: set[str], q: FloatArray) -> Closure | None:
    """What is left of a coupling when joints are locked: nothing of one whose joints are, else a joint that is held.

    Raises
    ------
    InvalidInput
        If it cannot hold with the joints where they are locked.
    """
    assert closure.polynomial is not None
    a, b = (name if name != "universe" else None for name in (closure.frame_a, closure.frame_b))
    free = [name for name in (a, b) if name is not None and name not in names]
    if len(free) == 2 or (a is None and free):
        return closure
    (at_a, at_b), (r_a, r_b) = (
        (0.0 if n is None else q[state.configuration_slice(n)][0] for n in (a, b)),
        closure.references,
    )
    asked = np.polynomial.Polynomial(closure.polynomial)
    if b in free:
        return replace(closure, frame_a="universe", polynomial=(float(asked(at_a - r_a)),), references=(0.0, r_b))
    places = [at_a - r_a] if a not in free else [x.real for x in (asked - (at_b - r_b)).roots() if abs(x.imag) < CLOSED]
    nearest = min(places, key=lambda x: abs(x - (at_a - r_a)), default=np.nan)
    if not abs(asked(nearest) - (at_b - r_b)) <= CLOSED:
        raise InvalidInput(
            f"coupling {closure.name!r} cannot hold with {b!r} locked at {at_b:.6g}: lock its joints where it does, "
            "for example at a configuration from close()"
        )
    if a not in free:
        return None
    assert a is not None
    return Closure(closure.name, closure.type, "universe", a, polynomial=(float(nearest),), references=(0.0, r_a))
