"""Overconstrained mechanisms from the lines of their hinges, exact or with their geometry rounded as in a file."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.chain import Closure, Closures, Placement

#: Mechanisms with hinges that move one by one, and their freedoms.
MECHANISMS = {"planar": 1, "spherical": 1, "bennett": 1, "sarrus": 1, "cranks": 1, "delta": 3}


def _lines(name):
    """Points and directions of the tree's hinges, parents of these, and hinges that close loops: line and two links."""
    serial = lambda count: [k - 1 for k in range(count)]  # noqa: E731
    z = np.array([0.0, 0.0, 1.0])
    if name == "planar":
        points = np.array([[0, 0, 0], [0.06, 0.11, 0], [0.31, 0.17, 0], [0.3, 0, 0]])
        return points, [z] * 4, serial(3), [(3, 2, -1)]
    if name == "spherical":
        axes = [
            Rotation.from_rotvec(turn).apply(z) for turn in ([0, 0, 0], [0.4, 0.2, 0], [0.5, 0.9, 0], [-0.2, 0.8, 0])
        ]
        return np.array([0.2 * axis for axis in axes]), axes, serial(3), [(3, 2, -1)]
    if name == "sarrus":
        y, across = np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0])
        one = np.array([[0.1, 0, 0], [0.25, 0, 0.12], [0.1, 0, 0.24]])
        other = np.array([[0, 0.1, 0.24], [0, 0.25, 0.12], [0, 0.1, 0]])
        return np.concatenate([one, other]), [y] * 3 + [across] * 3, serial(5), [(5, 4, -1)]
    if name == "cranks":
        crank, base = np.array([0.05, 0.1, 0.0]), np.array([[0, 0, 0], [0.2, 0, 0], [0.37, 0.04, 0]])
        points = np.array([base[0], base[0] + crank, base[1], base[2], base[1] + crank, base[2] + crank])
        return points, [z] * 6, [-1, 0, -1, -1], [(4, 1, 2), (5, 1, 3)]
    if name == "delta":
        return _delta()
    # Bennett: opposite links equal, twists in proportion to the lengths, opposite angles opposite.
    alpha, beta, first = 0.6, 1.1, 0.9
    lengths = 0.3 * np.sin([alpha, beta, alpha, beta])
    second = 2 * np.arctan(np.sin((beta + alpha) / 2) / np.sin((beta - alpha) / 2) / np.tan(first / 2))
    pose, points, axes = pin.SE3.Identity(), [], []
    for angle, length, twist in zip([first, second, -first, -second], lengths, [alpha, beta, alpha, beta], strict=True):
        points.append(pose.translation.copy())
        axes.append(pose.rotation[:, 2].copy())
        turned = pin.SE3(pin.utils.rotate("z", angle), np.zeros(3))
        pose = pose * turned * pin.SE3(pin.utils.rotate("x", twist), np.array([length, 0.0, 0.0]))
    assert np.allclose(pose.homogeneous, np.eye(4), atol=1e-12)
    return np.array(points), axes, serial(3), [(3, 2, -1)]


def _delta():
    """A delta robot of hinges: in each arm a crank, a bar, two rods and a lower bar, on which the platform hangs."""
    t, half = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.03, 0.0])
    base, elbow, wrist = np.array([0.2, 0, 0]), np.array([0.35, 0, -0.1]), np.array([0.05, 0, -0.4])
    n = np.cross(t, wrist - elbow) / np.linalg.norm(wrist - elbow)
    # Of each arm: crank, bar, second and first rod, lower bar; then hinges of the second rod and of the platform.
    own = [
        (base, t),
        (elbow, t),
        (elbow + half, n),
        (elbow - half, n),
        (wrist - half, n),
        (wrist + half, n),
        (wrist, t),
    ]
    turns = [Rotation.from_euler("z", 120.0 * arm, degrees=True) for arm in range(3)]
    lines = [(turn.apply(at), turn.apply(along)) for turn in turns for at, along in own[:5]]
    parents = [link for arm in (0, 5, 10) for link in (-1, arm, arm + 1, arm + 1, arm + 3)]
    # The last arm carries the platform, link 15.
    lines.append((turns[2].apply(own[6][0]), turns[2].apply(t)))
    parents.append(14)
    lines += [(turn.apply(at), turn.apply(along)) for turn in turns for at, along in own[5:6]]
    lines += [(turn.apply(at), turn.apply(along)) for turn in turns[:2] for at, along in own[6:]]
    cuts = [(16, 4, 2), (17, 9, 7), (18, 14, 12), (19, 15, 4), (20, 15, 9)]
    return np.array([at for at, _ in lines]), [along for _, along in lines], parents, cuts


def mechanism(name, digits=None, seed=0, flat=False):
    """A chain, closed at q = 0 but for its rounding, turned at random; ``digits`` decimals in metres and radians."""
    rng = np.random.default_rng(seed)
    points, axes, parents, cuts = _lines(name)
    if flat:
        points = np.array([[0, 0, 0], [0.1, 0, 0], [0.4, 0, 0], [0.3, 0, 0]])
    whole = Rotation.random(random_state=seed)
    frames = []
    for point, axis in zip(points, axes, strict=True):
        about = Rotation.align_vectors([axis], [[0.0, 0.0, 1.0]])[0] * Rotation.from_euler("z", rng.uniform(-3, 3))
        along = rng.uniform(-0.1, 0.1) * np.asarray(axis)
        frames.append(pin.SE3((whole * about).as_matrix(), whole.apply(point + along)))

    def rounded(pose):
        place, angles = pose.translation, Rotation.from_matrix(pose.rotation).as_euler("xyz")
        if digits is not None:
            place, angles = np.round(place, digits), np.round(angles, digits)
        return pin.SE3(Rotation.from_euler("xyz", angles).as_matrix(), place)

    model = pin.Model()
    for k, parent in enumerate(parents):
        local = frames[k] if parent < 0 else frames[parent].actInv(frames[k])
        joint = model.addJoint(parent + 1, pin.JointModelRZ(), rounded(local), f"hinge_{k}")
        model.addFrame(pin.Frame(f"link_{k}", joint, 0, pin.SE3.Identity(), pin.FrameType.BODY))
        centre = frames[k].actInv(points.mean(axis=0) @ whole.as_matrix().T)
        model.appendBodyToJoint(joint, pin.Inertia(0.5, centre, 1e-3 * np.eye(3)), pin.SE3.Identity())

    def placed(line, link):
        local = rounded(frames[line] if link < 0 else frames[link].actInv(frames[line]))
        return Placement(tuple(local.translation), tuple(Rotation.from_matrix(local.rotation).as_quat()))

    link = lambda k: "universe" if k < 0 else f"link_{k}"  # noqa: E731
    closures = tuple(
        Closure(f"cut_{line}", "revolute", link(a), link(b), placed(line, a), placed(line, b)) for line, a, b in cuts
    )
    chain = ep.ClosedChain(model, Closures(name, closures=closures))
    return chain if digits is None else chain.with_tolerance(0.5 * 10.0**-digits)
