"""Random robots as MJCF: every kind of joint, one to three joints a body, springs, loops that are closed somewhere, and
couplings of joints. Several bodies may stand on the world.

The text is written here without exo_pin. MuJoCo computes where the bodies are, to place the equalities.
"""

from typing import NamedTuple

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

#: Joints of one body, in their order. A ball may not come before a hinge of the same body.
JOINTS = (
    (),
    ("hinge",),
    ("hinge",),
    ("hinge",),
    ("slide",),
    ("ball",),
    ("hinge", "hinge"),
    ("slide", "hinge"),
    ("hinge", "slide"),
    ("hinge", "ball"),
    ("ball", "slide"),
    ("hinge", "hinge", "hinge"),
    ("slide", "slide", "hinge"),
    ("slide", "hinge", "slide"),
)
#: Equalities: kind, between bodies or sites.
EQUALITIES = (("connect", "body"), ("connect", "site"), ("weld", "body"), ("weld", "site"), ("weld point", "body"))


class Robot(NamedTuple):
    """A text, and a qpos where its equalities hold."""

    text: str
    qpos: np.ndarray


def numbers(values):
    return " ".join(repr(float(value)) for value in np.asarray(values).reshape(-1))


def random_robot(seed, passive=True):
    """A robot with three to seven bodies, one or two equalities, and up to two couplings of joints.

    Parameters
    ----------
    seed : int
        Of everything.
    passive : bool
        Whether joints have springs and dampers.
    """
    rng = np.random.default_rng(seed)
    tree = _tree(rng, passive)
    kinds = [EQUALITIES[k] for k in rng.integers(len(EQUALITIES), size=rng.integers(1, 3))]
    open_model = mujoco.MjModel.from_xml_string(_document(rng.spawn(1)[0], tree, "", {}))
    data = mujoco.MjData(open_model)
    # MuJoCo closes a connect of bodies at qpos0, and nowhere else by itself.
    at_start = ("connect", "body") in kinds
    if not at_start:
        mujoco.mj_integratePos(open_model, data.qpos, rng.uniform(-1.0, 1.0, open_model.nv), 1.0)
    mujoco.mj_kinematics(open_model, data)
    lines, sites = [], {}
    for index, kind in enumerate(kinds):
        pair = _pair(rng, open_model)
        if pair is not None:
            lines.append(_equality(rng, data, index, kind, pair, sites))
    lines += _couplings(rng.spawn(1)[0], open_model, data.qpos)
    return Robot(_document(rng, tree, "\n".join(lines), sites), data.qpos.copy())


def _couplings(rng, model, qpos):
    """Joint equalities that hold at qpos: hinges and slides that follow others, or stay where they are."""
    scalar = [k for k in range(model.njnt) if model.jnt_type[k] >= int(mujoco.mjtJoint.mjJNT_SLIDE)]
    order = rng.permutation(scalar).tolist()
    lines = []
    for _ in range(int(rng.integers(0, 3))):
        if len(order) < 2:
            break
        follower, leader = order.pop(), order[0]
        y, x = (qpos[model.jnt_qposadr[k]] - model.qpos0[model.jnt_qposadr[k]] for k in (follower, leader))
        powers = rng.uniform(-1.0, 1.0, int(rng.integers(1, 5)))
        held = rng.random() < 0.2
        constant = y if held else y - sum(c * x ** (k + 1) for k, c in enumerate(powers))
        second = "" if held else f'joint2="{model.joint(leader).name}"'
        polynomial = [constant] if held else [constant, *powers]
        first = f'joint1="{model.joint(follower).name}"'
        lines.append(f'<joint name="gear{len(lines)}" {first} {second} polycoef="{numbers(polynomial)}"/>')
    if len(order) > 1 and rng.random() < 0.2:
        first = f'joint1="{model.joint(order[0]).name}"'
        lines.append(f'<joint name="idle" active="false" {first} polycoef="0.3"/>')
    return lines


def _pair(rng, model):
    """Two bodies that can move against each other, if there are any."""
    pairs = [
        (one, other)
        for one in range(model.nbody)
        for other in range(1, model.nbody)
        if one != other and model.body_weldid[one] != model.body_weldid[other]
    ]
    return pairs[rng.integers(len(pairs))] if pairs else None


def _tree(rng, passive):
    """Nested bodies: (name, attributes, joints, mass, children)."""
    count = int(rng.integers(3, 8))
    bodies = []
    for index in range(count):
        parent = int(rng.integers(-1, index)) if index else -1
        free = parent == -1 and rng.random() < 0.2
        joints = ("free",) if free else JOINTS[rng.integers(0 if index else 1, len(JOINTS))]
        bodies.append((parent, _body_text(rng, index, joints, passive)))
    return bodies


def _body_text(rng, index, joints, passive):
    """What stands in a body's element."""
    pose = f'pos="{numbers(rng.uniform(-0.5, 0.5, 3))}" quat="{numbers(Rotation.random(rng=rng).as_quat())}"'
    lines = [f'<body name="body{index}" {pose}>']
    # Joints of one body along different axes: two along one would be a motion without inertia.
    aligned = iter(rng.permutation(np.eye(3)))
    for k, kind in enumerate(joints):
        given = {"name": f"joint{index}_{k}", "type": kind}
        if kind != "free":
            # MuJoCo has no armature of a free joint that Pinocchio has, too.
            given["pos"] = numbers(rng.uniform(-0.2, 0.2, 3))
            given["armature"] = numbers(rng.choice([0.0, rng.uniform(0.0, 0.5)]))
        if kind in ("hinge", "slide"):
            axis = next(aligned) if rng.random() < 0.3 else rng.normal(size=3)
            given["axis"] = numbers(axis)
            given["ref"] = numbers(rng.choice([0.0, rng.uniform(-1.0, 1.0)]))
            if passive and rng.random() < 0.6:
                given["springref"] = numbers(rng.uniform(-1.0, 1.0))
        if passive:
            given["stiffness"] = numbers(rng.choice([0.0, rng.uniform(0.0, 20.0)]))
            given["damping"] = numbers(rng.choice([0.0, rng.uniform(0.0, 3.0)]))
        attributes = " ".join(f'{key}="{value}"' for key, value in given.items())
        lines.append(f"<joint {attributes}/>")
    # Six point masses in space make an inertia that a body can have, far from round.
    points, weights = rng.uniform(-0.3, 0.3, (6, 3)), rng.uniform(0.1, 1.0, 6)
    centre = weights @ points / weights.sum()
    off = points - centre
    tensor = sum(m * (r @ r * np.eye(3) - np.outer(r, r)) for m, r in zip(weights, off, strict=True))
    six = [tensor[entry] for entry in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    lines.append(f'<inertial pos="{numbers(centre)}" mass="{numbers(weights.sum())}" fullinertia="{numbers(six)}"/>')
    return "\n".join(lines)


def _document(rng, bodies, equalities, sites):
    """The tree nested, sites and equalities in it."""

    def element(index):
        inner = "\n".join(element(k) for k, (parent, _) in enumerate(bodies) if parent == index)
        if index == -1:
            return f"{inner}\n{''.join(sites.get(0, []))}"
        return f"{bodies[index][1]}\n{''.join(sites.get(f'body{index}', []))}\n{inner}\n</body>"

    gravity = numbers(rng.normal(size=3) * 6.0)
    flag = '<flag gravity="disable"/>' if rng.random() < 0.15 else ""
    return f"""<mujoco model="random"><compiler angle="radian" balanceinertia="false"/>
<option gravity="{gravity}">{flag}</option><worldbody>
{element(-1)}
</worldbody><equality>{equalities}</equality></mujoco>"""


def _equality(rng, data, index, kind, pair, sites):
    """An equality that holds where the data stand; sites are added to ``sites`` by body."""
    kind, between = kind
    names = ["world" if body == 0 else data.model.body(body).name for body in pair]
    point, turn = rng.uniform(-0.5, 0.5, 3), Rotation.random(rng=rng)
    places = []
    for body in pair:
        R = Rotation.from_matrix(data.xmat[body].reshape(3, 3))
        places.append((R.inv().apply(point - data.xpos[body]), R.inv() * turn))
    head = f'name="loop{index}"'
    if between == "site":
        for k, (body, name, (position, rotation)) in enumerate(zip(pair, names, places, strict=True)):
            quaternion = numbers(rotation.as_quat(scalar_first=True))
            site = f'<site name="site{index}_{k}" pos="{numbers(position)}" quat="{quaternion}"/>'
            sites.setdefault(0 if body == 0 else name, []).append(site)
        return f'<{kind} {head} site1="site{index}_0" site2="site{index}_1" {_scale(rng, kind)}/>'
    head += f' body1="{names[0]}" body2="{names[1]}"'
    if kind == "connect":
        return f'<connect {head} anchor="{numbers(places[0][0])}"/>'
    one, other = (Rotation.from_matrix(data.xmat[body].reshape(3, 3)) for body in pair)
    relative = (one.inv() * other).as_quat(scalar_first=True)
    relpose = f'relpose="{numbers(places[0][0])} {numbers(relative)}" anchor="{numbers(places[1][0])}"'
    return f"<weld {head} {relpose} {_scale(rng, kind)}/>"


def _scale(rng, kind):
    if kind == "weld point":
        return 'torquescale="0"'
    return f'torquescale="{rng.uniform(0.1, 3.0)!r}"' if kind == "weld" and rng.random() < 0.5 else ""
