"""Files of chains with every number of their geometry rounded, and loops with a small feature."""

import re

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from exo_pin.chain import ClosedChain, Closure, Closures, Placement


def _rounded(words, digits):
    return " ".join(repr(round(float(word), digits)) for word in words)


def _attributes(names, text, digits):
    pattern = rf'((?:{names})=")([^"]*)'
    return re.sub(pattern, lambda found: found.group(1) + _rounded(found.group(2).split(), digits), text)


def rounded_urdf(chain, digits, folder):
    """A URDF, whose closures file keeps its points exact; read again."""
    path = chain.with_tolerance(0.0).to_urdf(folder)
    path.write_text(_attributes("xyz|rpy", path.read_text(encoding="utf-8"), digits), encoding="utf-8")
    return ClosedChain.from_urdf(path)


def rounded_sdf(chain, digits, folder):
    """An SDF with roll, pitch and yaw, read again."""

    def pose(found):
        numbers = [float(word) for word in found.group(1).split()]
        angles = Rotation.from_quat(numbers[3:]).as_euler("xyz")
        return f"<pose>{_rounded([*numbers[:3], *angles], digits)}</pose>"

    path = chain.to_sdf(folder)
    text = re.sub(r'<pose rotation_format="quat_xyzw">([^<]*)</pose>', pose, path.read_text(encoding="utf-8"))
    text = re.sub(r"<xyz>([^<]*)", lambda found: f"<xyz>{_rounded(found.group(1).split(), digits)}", text)
    path.write_text(text, encoding="utf-8")
    return ClosedChain.from_sdf(path)


def rounded_mjcf(chain, digits, folder):
    """An MJCF, read again."""
    text = chain.to_mjcf(folder).read_text(encoding="utf-8")
    return ClosedChain.from_mjcf(_attributes("pos|quat|axis", text, digits))


FORMATS = {"urdf": rounded_urdf, "sdf": rounded_sdf, "mjcf": rounded_mjcf}


def small_feature(seed, small):
    """A loop of seven hinges, which has one freedom, with a feature of a relative size that is small.

    It is nearly a planar loop, nearly a spherical one, or two of its hinges are nearly on one line.
    """
    rng = np.random.default_rng(seed)
    points, axes = rng.uniform(-0.3, 0.3, (7, 3)), rng.normal(size=(7, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    if seed % 3 == 0:
        axes, points[:, 2] = np.array([0.0, 0.0, 1.0]) + small * axes, small * points[:, 2]
    elif seed % 3 == 1:
        points = 0.3 * axes + small * points
    else:
        points[1], axes[1] = points[0] + small * points[1], axes[0] + small * axes[1]
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    turns = [
        Rotation.align_vectors([axis], [[0.0, 0.0, 1.0]])[0] * Rotation.from_euler("z", rng.uniform(-3, 3))
        for axis in axes
    ]
    frames = [pin.SE3(turn.as_matrix(), point) for turn, point in zip(turns, points, strict=True)]
    model = pin.Model()
    for k in range(6):
        joint = model.addJoint(
            k, pin.JointModelRZ(), frames[k] if k == 0 else frames[k - 1].actInv(frames[k]), f"hinge_{k}"
        )
        model.addJointFrame(joint, -1)
        model.addFrame(pin.Frame(f"link_{k}", joint, 0, pin.SE3.Identity(), pin.FrameType.BODY))
        model.appendBodyToJoint(joint, pin.Inertia(0.5, np.zeros(3), 1e-2 * np.eye(3)), pin.SE3.Identity())

    def placed(place):
        return Placement(tuple(place.translation), tuple(pin.Quaternion(place.rotation).normalized().coeffs()))

    cut = Closure("cut", "revolute", "universe", "link_5", placed(frames[6]), placed(frames[5].actInv(frames[6])))
    return ClosedChain(model, Closures("loop", closures=(cut,)))
