"""A Stewart platform as Gazebo's users write it: an SDF with a closed loop for every piston.

Facts of the model that is passed on among them (github.com/daniel-s-ingram/stewart, sdf/stewart/model.sdf.erb): a base
of 1000 kg that no joint holds, a platform of 1 kg 2 m above it, six pistons between neighbouring pairs of points; every
piston is a cylinder and a shaft on a slide with limits, and hangs at both ends by two hinges, about y and then about x,
on a small ball between them. Balls, cylinders and shafts weigh 0.1 kg and have no moments of inertia. Every joint has
limits. The numbers here are our own.

Two hinges at both ends of a piston hold it against turning about itself: six such legs leave no freedom in general, and
that file's readme says that yaw does not work. With a ball at the platform the six freedoms are there.
"""

import numpy as np
from scipy.spatial.transform import Rotation

#: Masses, kg, heights of the joints, radius of the platform's and the base's circle, m.
BASE, PLATFORM, PART = 1000.0, 1.0, 0.1
LOW, HIGH, INNER, OUTER = 0.25, 2.05, 0.6, 0.9
_LIMIT = "<limit><lower>{}</lower><upper>{}</upper>{}</limit>"


def _numbers(values):
    return " ".join(repr(float(value)) for value in np.ravel(values))


def _link(name, pose, mass, moments, shape=""):
    entries = zip(("ixx", "iyy", "izz"), np.broadcast_to(moments, 3), strict=True)
    inertia = "".join(f"<{key}>{float(value)!r}</{key}>" for key, value in entries)
    return (
        f'<link name="{name}"><pose>{_numbers(pose)}</pose><inertial><mass> {mass!r} </mass>'
        f"<inertia>{inertia}</inertia></inertial>{shape}</link>"
    )


def _joint(name, kind, parent, child, axes=(), pose="", limits="", damping=0.0):
    """Spaces around the names of links, as in the published file."""
    drag = f"<dynamics><damping>{damping!r}</damping></dynamics>" if damping else ""
    tags = ("axis", "axis2")[: len(axes)]
    parts = "".join(
        f"<{tag}><xyz>{_numbers(axis)}</xyz>{limits}{drag}</{tag}>" for tag, axis in zip(tags, axes, strict=True)
    )
    return (
        f'<joint name="{name}" type="{kind}"><parent> {parent} </parent><child> {child} </child>{pose}{parts}</joint>'
    )


def stewart(lower="hinges", upper="ball", moments=0.0, held=False, limits=True, damping=0.0):
    """The text of an SDF.

    Parameters
    ----------
    lower, upper : {"hinges", "universal", "ball"}
        Joints of the pistons on the base and on the platform. "hinges" are two on a link of their own, as published.
    moments : float
        Of balls, cylinders and shafts, kg m²; zero as published.
    held : bool
        Whether the base is fixed to the world.
    limits : bool
        Whether hinges have limits, as published.
    damping : float
        Of all hinges and slides, N m s/rad and N s/m.
    """
    x, y, z = np.eye(3)
    turn = _LIMIT.format(-0.786, 0.786, "") if limits else ""
    cylinder = "<cylinder><radius>0.1</radius><length>1.0</length></cylinder>"
    shape = f'<visual name="v"><geometry>{cylinder}</geometry></visual>'
    found = [
        _link("base_link", [0, 0, LOW / 2, 0, 0, 0], BASE, [250.0, 250.0, 500.0], shape),
        _link("platform_link", [0, 0, HIGH + 0.05, 0, 0, 0], PLATFORM, [0.25, 0.25, 0.5], shape),
    ]
    if held:
        found.append(_joint("ground", "fixed", "world", "base_link"))
    for leg in range(6):
        # Pairs of neighbouring points, on the platform turned by half a sector.
        pair, side = np.deg2rad(120.0 * (leg // 2)), (-1.0) ** leg
        bottom = np.array([OUTER * np.cos(pair + 0.15 * side), OUTER * np.sin(pair + 0.15 * side), LOW])
        angle = pair + side * (np.pi / 3 - 0.2)
        top = np.array([INNER * np.cos(angle), INNER * np.sin(angle), HIGH])
        along = (top - bottom) / np.linalg.norm(top - bottom)
        yaw = np.arctan2(top[1] - bottom[1], top[0] - bottom[0]) - np.pi / 2
        lean = Rotation.align_vectors([along, [np.cos(yaw), np.sin(yaw), 0.0]], [z, x])[0].as_euler("xyz")
        middle, half = (bottom + top) / 2, np.linalg.norm(top - bottom) / 2
        found += [
            _link(f"piston{leg}_cylinder_link", [*middle, *lean], PART, moments, shape),
            _link(f"piston{leg}_shaft_link", [*middle, *lean], PART, moments),
            _joint(
                f"piston{leg}_prismatic_joint",
                "prismatic",
                f"piston{leg}_cylinder_link",
                f"piston{leg}_shaft_link",
                [z],
                limits=_LIMIT.format(-0.5, 0.8, "<velocity>1</velocity><effort>500</effort>"),
                damping=damping,
            ),
        ]
        for kind, place, body, part, end in (
            (lower, bottom, "base_link", "cylinder", -half),
            (upper, top, "platform_link", "shaft", half),
        ):
            name, piston = f"{'bottom' if end < 0 else 'top'}{leg}", f"piston{leg}_{part}_link"
            pose = f"<pose>0 0 {float(end)!r} 0 0 0</pose>"
            if kind == "hinges":
                found += [
                    _link(f"{name}_ball_link", [*place, 0, 0, yaw], PART, moments),
                    _joint(f"{name}_joint", "revolute", body, f"{name}_ball_link", [y], "", turn, damping),
                    _joint(f"{name}_pitch_joint", "revolute", f"{name}_ball_link", piston, [x], pose, turn, damping),
                ]
            elif kind == "universal":
                # Drake does not drive them.
                passive = turn.replace("</limit>", "<effort>0</effort></limit>")
                found.append(_joint(f"{name}_joint", "universal", body, piston, [y, x], pose, passive, damping))
            else:
                found.append(_joint(f"{name}_joint", "ball", body, piston, [], pose))
    return f'<?xml version="1.0" ?><sdf version="1.5"><model name="stewart">{"".join(found)}</model></sdf>'
