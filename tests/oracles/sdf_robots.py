"""Random robots as SDF: every joint type, poses relative to chains of frames, axes expressed in any of them.

The text is written here without exo_pin. Names are different in all models, so that Drake's can be told apart.
"""

import numpy as np
from scipy.spatial.transform import Rotation

KINDS = ("revolute", "revolute", "prismatic", "continuous", "universal", "ball", "fixed")


def numbers(values):
    return " ".join(repr(float(value)) for value in np.asarray(values).reshape(-1))


def pose_text(rng, relative_to=""):
    """A random <pose>, in one of the three ways to write an orientation."""
    place, way = rng.uniform(-0.5, 0.5, 3), rng.integers(3)
    given = f' relative_to="{relative_to}"' if relative_to else ""
    if way == 0:
        quaternion = Rotation.random(rng=rng).as_quat()
        return f'<pose{given} rotation_format="quat_xyzw">{numbers(place)} {numbers(quaternion)}</pose>'
    angles = rng.uniform(-1.5, 1.5, 3)
    if way == 1:
        return f'<pose{given} degrees="true">{numbers(place)} {numbers(np.degrees(angles))}</pose>'
    return f"<pose{given}>{numbers(place)} {numbers(angles)}</pose>"


def inertial_text(rng):
    """Six point masses; sometimes what the specification has by default."""
    way = rng.integers(6)
    if way == 0:
        return ""
    if way == 1:
        return f"<inertial>{pose_text(rng)}<mass>1.0</mass></inertial>"
    points, weights = rng.uniform(-0.3, 0.3, (6, 3)), rng.uniform(0.1, 1.0, 6)
    tensor = sum(m * (r @ r * np.eye(3) - np.outer(r, r)) for m, r in zip(weights, points, strict=True))
    entries = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
    inertia = "".join(f"<{tag}>{float(tensor[entry])!r}</{tag}>" for tag, entry in entries.items())
    return f"<inertial>{pose_text(rng)}<mass>{float(weights.sum())!r}</mass><inertia>{inertia}</inertia></inertial>"


def axis_text(rng, tag, kind, frames):
    given = f' expressed_in="{rng.choice(frames)}"' if rng.random() < 0.5 else ""
    direction = rng.choice(np.eye(3)) if rng.random() < 0.3 else rng.normal(size=3)
    limit = "<limit><lower>-1.5</lower><upper>2.5</upper><effort>30</effort></limit>" if kind == "revolute" else ""
    damping = f"<dynamics><damping>{float(rng.uniform(0.0, 2.0))!r}</damping></dynamics>"
    return f"<{tag}><xyz{given}>{numbers(direction)}</xyz>{limit}{damping}</{tag}>"


def joint_text(rng, name, parent, child, frames):
    """A joint; the two axes of a universal joint are at right angles, as Drake's have to be."""
    kind = KINDS[rng.integers(len(KINDS))]
    place = pose_text(rng, rng.choice(frames) if rng.random() < 0.5 else "") if rng.random() < 0.8 else ""
    axes = ""
    if kind == "universal":
        x, y, _ = Rotation.random(rng=rng).as_matrix().T
        axes = f"<axis><xyz>{numbers(x)}</xyz></axis><axis2><xyz>{numbers(y)}</xyz></axis2>"
    elif kind not in ("ball", "fixed"):
        axes = axis_text(rng, "axis", kind, frames)
    return f'<joint name="{name}" type="{kind}">{place}<parent>{parent}</parent><child>{child}</child>{axes}</joint>'


def parts(rng, prefix, count):
    """Links, joints and frames of one model; and the names of its links."""
    links, frames, lines = [], ["__model__"], []
    for k in range(count):
        name = f"{prefix}link{k}"
        relative = rng.choice(frames) if rng.random() < 0.6 else ""
        lines.append(f'<link name="{name}">{pose_text(rng, relative)}{inertial_text(rng)}</link>')
        parent = links[rng.integers(len(links))] if links else ""
        links.append(name)
        frames.append(name)
        if rng.random() < 0.6:
            frame = f"{prefix}frame{k}"
            relative = rng.choice(frames) if rng.random() < 0.5 else ""
            lines.append(f'<frame name="{frame}" attached_to="{name}">{pose_text(rng, relative)}</frame>')
            frames.append(frame)
        if parent:
            attached = [each for each in frames if each == f"{prefix}frame{links.index(parent)}"]
            lines.append(joint_text(rng, f"{prefix}joint{k}", (attached or [parent])[0], name, frames))
            if rng.random() < 0.3:
                frames.append(f"{prefix}joint{k}")
    order = rng.permutation(len(lines))
    return [lines[k] for k in order], links, frames


def random_sdf(seed):
    """The text of a robot of three to six links, often with a nested model, free or on the world."""
    rng = np.random.default_rng(seed)
    lines, links, frames = parts(rng, "", int(rng.integers(3, 7)))
    if rng.random() < 0.6:
        inner, inner_links, _ = parts(rng, "in_", int(rng.integers(2, 4)))
        around = rng.choice(frames[1:]) if rng.random() < 0.5 else ""
        given = f' placement_frame="{inner_links[-1]}"' if rng.random() < 0.5 else ""
        lines.append(f'<model name="inner"{given}>{pose_text(rng, around)}{"".join(inner)}</model>')
        names = [*frames, f"inner::{inner_links[0]}"]
        lines.append(joint_text(rng, "bridge", links[-1], f"inner::{inner_links[0]}", names))
    if rng.random() < 0.5:
        lines.append(joint_text(rng, "base", "world", links[0], frames))
    place = pose_text(rng) if rng.random() < 0.5 else ""
    canonical = f' canonical_link="{links[0]}"' if rng.random() < 0.3 else ""
    return f'<sdf version="1.9"><model name="robot"{canonical}>{place}{"".join(lines)}</model></sdf>'


def _link(name, place, mass=1.0):
    moments = "<ixx>0.01</ixx><iyy>0.012</iyy><izz>0.008</izz><ixy>0.0005</ixy><ixz>0.0</ixz><iyz>0.0003</iyz>"
    inertial = (
        f"<inertial><pose>0.01 0.005 -0.05 0 0 0.1</pose><mass>{mass}</mass><inertia>{moments}</inertia></inertial>"
    )
    picture = "<visual name='v'><geometry><sphere><radius>0.1</radius></sphere></geometry></visual>"
    return f"<link name='{name}'><pose>{place}</pose>{inertial}{picture}</link>"


def _joint(name, kind, parent, child, more=""):
    return f"<joint name='{name}' type='{kind}'>{more}<parent>{parent}</parent><child>{child}</child></joint>"


def _hinge(rest="", xyz="0 1 0"):
    return f"<axis><xyz>{xyz}</xyz>{rest}</axis>"


_STOPPED = "<limit><lower>-1</lower><upper>1</upper></limit><dynamics><damping>0.2</damping></dynamics>"
_SPRUNG = "<dynamics><spring_reference>0.1</spring_reference><spring_stiffness>40</spring_stiffness></dynamics>"

#: A free pelvis with one leg in the plane y = 0. A crank turns the foot by a rod (hinge and ball); a strut that slides
#: joins the pelvis (ball) to the shin (hinge). Drives and limits are where hinges have them.
LEG = f"""<?xml version="1.0"?><!-- a leg --><sdf version="1.6"><model name="leg"><pose>0.3 0 0 0 0 0.4</pose>
{_link("pelvis", "0 0 1 0 0 0", 5.0)}{_link("thigh", "0 0 1 0 0.2 0", 2.0)}{_link("shin", "0.1 0 0.6 0 -0.3 0")}
{_link("foot", "0 0 0.2 0 0 0", 0.5)}{_link("crank", "0.05 0 0.45 0 0 0", 0.3)}{
    _link("rod", "0.15 0 0.45 0 0.1 0", 0.2)
}
{_link("barrel", "-0.1 0 1 0 0 0", 0.4)}{_link("piston", "-0.07 0 0.9 0 0 0", 0.3)}
{_joint("hip", "revolute", "pelvis", "thigh", _hinge(_STOPPED))}
{_joint("knee", "revolute", "thigh", "shin", _hinge(_SPRUNG))}
{_joint("ankle", "revolute", "shin", "foot", _hinge(_STOPPED))}
{_joint("drive", "revolute", "shin", "crank", _hinge(_STOPPED))}
{_joint("crank_rod", "revolute", "crank", "rod", _hinge())}
{_joint("rod_foot", "ball", "rod", "foot", "<pose>0.12 0 -0.02 0 0 0</pose>")}
{
    _joint(
        "strut_pelvis",
        "ball",
        "barrel",
        "pelvis",
        "<pose>-0.1 0 0 0 0 0</pose>" + _hinge("<dynamics><damping>0.01</damping></dynamics>"),
    )
}
{_joint("slide", "prismatic", "barrel", "piston", _hinge(_STOPPED, "0.3 0 -1"))}
{_joint("strut_shin", "revolute", "piston", "shin", "<pose>0.02 0 -0.05 0 0 0</pose>" + _hinge())}
<plugin filename="x.so" name="x"/></model></sdf>"""
