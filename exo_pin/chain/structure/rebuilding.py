"""A tree built anew, with some joints of another kind, name or place."""

from __future__ import annotations

from collections.abc import Container, Mapping

import pinocchio as pin

from .motion_axes import q_slice, v_slice

_BY_POSITION = ("lowerPositionLimit", "upperPositionLimit")
_BY_VELOCITY = (
    "lowerEffortLimit", "upperEffortLimit", "lowerVelocityLimit", "upperVelocityLimit", "damping", "armature",
    "lowerDryFrictionLimit", "upperDryFrictionLimit",
)  # fmt: skip
#: Data of a model that a new one takes over, by the coordinates of q and of v.
COPIED = (_BY_POSITION, _BY_VELOCITY)


def rebuilt(
    old: pin.Model,
    kinds: Mapping[int, pin.JointModel] | None = None,
    places: Mapping[int, pin.SE3] | None = None,
    joint_names: Mapping[str, str] | None = None,
    frame_names: Mapping[str, str] | None = None,
    without: Container[int] = (),
) -> pin.Model:
    """The tree with some joints of another kind, in another place, called otherwise or gone; the rest of it stays.

    Parameters
    ----------
    old : pinocchio.Model
        The tree.
    kinds, places : mapping, optional
        Of joints, by index: what they become, without the data that the joint had; and their placements.
    joint_names, frame_names : mapping, optional
        New names by old ones, of joints, and of frames that are no joint's.
    without : container of int
        Joints that go with their bodies, which carry no other.

    Returns
    -------
    pinocchio.Model
        With the reference configurations where the coordinates are the same.
    """
    kinds, places, named, called = kinds or {}, places or {}, joint_names or {}, frame_names or {}
    new = pin.Model()
    new.name, new.gravity = old.name, old.gravity
    new.inertias[0] = old.inertias[0]
    now = {0: 0}
    for index in (i for i in range(1, old.njoints) if i not in without):
        name = old.names[index]
        kind, place = kinds.get(index, old.joints[index]), places.get(index, old.jointPlacements[index])
        now[index] = new.addJoint(now[old.parents[index]], kind, place, named.get(name, name))
        new.inertias[now[index]] = old.inertias[index]
    frames = {0: 0}
    for number, frame in enumerate(list(old.frames)[1:], 1):
        if frame.parentJoint not in now:
            continue
        names = named if frame.type == pin.FrameType.JOINT else called
        above = frames.get(frame.parentFrame, 0)
        own = pin.Frame(
            names.get(frame.name, frame.name), now[frame.parentJoint], above, frame.placement, frame.type, frame.inertia
        )
        frames[number] = new.addFrame(own, False)
    for index in now.keys() - {0, *kinds}:
        for group, part in zip(COPIED, (q_slice, v_slice), strict=True):
            for key in group:
                getattr(new, key)[part(new, now[index])] = getattr(old, key)[part(old, index)]
    if not kinds and new.nq == old.nq:
        for item in old.referenceConfigurations:
            new.referenceConfigurations[item.key()] = item.data()
    return new
