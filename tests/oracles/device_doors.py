"""One question about a device of any kind at every door, and devices to ask."""

import numpy as np
from handed_devices import handed
from idle_devices import random_device
from limb_devices import limb_device
from motor_kind import MotorKind
from places import URDF
from scenes import commands
from scipy.spatial.transform import Rotation

import exo_pin as ep

MAN = ep.Wearer(1.755, 85.0, "male", elbow_flexion=0.6, payload=0.5)
MIRROR = np.array([1.0, -1.0, 1.0])
#: Clinical angles of a slow lift, degrees.
ANGLES = np.array([[5.0, 40.0, 55.0, 70.0], [30.0, 30.0, 20.0, 10.0], [0.0, 10.0, 5.0, 20.0]])
#: Of random devices, which reach less far.
NEAR = np.array([[3.0, 8.0, 12.0, 5.0], [4.0, 2.0, -3.0, 8.0], [0.0, 4.0, 2.0, -5.0]])
#: Devices of kinds that are not of the package, by name.
KINDS = {"motor-1": MotorKind(1), "motor-3": MotorKind(3)}
FORCE, MOMENT, AT = np.array([2.0, -1.0, -5.0]), np.array([0.1, 0.0, -0.1]), np.array([0.0, 0.02, -0.2])


def load(side):
    """In the hand, on either side the mirror image of the other's."""
    sign = MIRROR if side == "right" else np.ones(3)
    return ep.Load(FORCE * sign, MOMENT * (-sign if side == "right" else 1.0), AT * sign)


def shipped(name):
    """A robot file or a preset, on the arm of one man."""
    path = URDF / f"{name}.urdf"
    return ep.load(path if path.exists() else name).worn_by(MAN)


def generated(name):
    """A random device by family and seed."""
    family, seed = name.split("-")
    if family == "idle":
        return ep.ShoulderExo.from_device(random_device(int(seed))[0])
    if family == "limbs":
        rng = np.random.default_rng(int(seed))
        return ep.ShoulderExo.from_device(limb_device(rng, 2 + int(seed) % 2, int(seed) % 3))
    return handed(int(seed))


def device_of(name):
    """The device of a name, and poses to ask it in, as clinical angles."""
    if name in KINDS:
        return ep.ShoulderExo.from_device(KINDS[name]), ANGLES
    family = name.split("-")[0]
    return (generated(name), NEAR) if family in ("idle", "limbs", "handed") else (shipped(name), ANGLES)


def rounding(answer):
    """N that forces in balance may differ by."""
    return 1e-8 * max(1.0, np.nanmax(np.abs(answer.limb_wrenches), initial=0.0))


def answers(exo, angles, limits="design"):
    """Numbers and verdicts of a device in clinical angles by door, as arrays; an error by its name.

    Forces F are those on the shoulder, f the efforts, J rates of the drives for turns of the arm.
    """
    poses, force = exo.pose(*angles), load(exo.side)
    query, found = {"load": force, "limits": limits}, {}

    def ask(name, question):
        try:
            for key, value in question().items():
                found[f"{name} {key}"] = np.asarray(value)
        except ep.ExoPinError as error:
            found[f"{name} raises"] = np.asarray(type(error).__name__)

    def numbers(answer):
        own = {"F": answer.shoulder_force, "f": answer.actuator_forces}
        return own | {"status": answer.status, "can_hold": answer.can_hold}

    def compared():
        table = exo.compare(exo, poses=poses, **query)
        return {key: table[name][-1] for key, name in (("held", "holdable"), ("peak", "peak_F_s_N"))}

    def reached():
        space = exo.workspace(poses, ["forces", "stroke"], force)
        return {"inside": space.inside, "magnitude": np.where(space.inside, space.magnitude, np.nan)}

    def followed():
        movement = ep.Movement.from_samples(np.arange(poses.shape[0] if hasattr(poses, "shape") else len(poses)), poses,
                                            smoothing=None)  # fmt: skip
        return numbers(exo.follow(movement, static=True, **query).reaction)

    ask("reaction", lambda: numbers(exo.reaction(poses, **query)))
    ask("minimal", lambda: numbers(exo.reaction(poses, split="minimal", constraint_bounds=0.0, **query)))
    ask("map", lambda: numbers(exo.reaction_map(poses, **query)))
    ask("follow", followed)
    ask("compare", compared)
    ask("workspace", reached)
    ask("singularity", lambda: {"kind": exo.singularity(poses).kind})
    ask("jacobian", lambda: {"J": exo.jacobian(poses)})
    return found


def told(exo, angles, person=None):
    """What a device says in words, tables and pictures, by door; an error by its name and message.

    Of a picture the parts that are drawn, and where.
    """
    pose, poses, found = exo.pose(*angles[:, 1]), exo.pose(*angles), {}

    def ask(name, question):
        try:
            found[name] = question()
        except ep.ExoPinError as error:
            found[name] = f"{type(error).__name__}: {error}"

    def drawn():
        scene = exo.view()
        return [(command.get("type"), command.get("path"), str(command.get("matrix"))) for command in commands(scene)]

    certain = {"uncertainties": {"offset_mm": 0.0, "pose_deg": 0.0}}
    ask("pose", lambda: str(exo.reaction(pose)))
    ask("stack", lambda: str(exo.reaction(poses)))
    ask("json", lambda: exo.reaction(pose).to_json())
    ask("workspace", lambda: str(exo.workspace(poses)))
    ask("compare", lambda: str(exo.compare(exo, poses=poses)))
    ask("uncertainty", lambda: str(exo.uncertainty(pose, **certain)))
    ask("remedy", lambda: str(exo.remedy(pose)))
    ask("elastic", lambda: str(exo.reaction(pose, split="elastic")))
    ask("positions", lambda: str(exo.inverse_kinematics(pose).positions.round(9) + 0.0))
    ask("configurations", lambda: str(exo.configurations(pose).round(9) + 0.0))
    ask("check", lambda: str(exo.check()))
    ask("name", lambda: repr(exo))
    ask("picture", drawn)
    if person is not None:
        ask("contact", lambda: str(exo.joint_contact(pose, person)))
    return found


def assert_same(one, two, names=None, but=()):
    """Answers of two devices are equal: words exactly, numbers to rounding of the largest force."""
    assert one.keys() - set(but) == two.keys() - set(but)
    size = max([1.0, *(np.nanmax(np.abs(a), initial=0.0) for key, a in one.items() if key[-2:] in (" F", " f"))])
    for key in one.keys() - set(but):
        a, b = one[key], two[key]
        if a.dtype.kind in "fc":
            scale = 1e-6 if key.startswith(("minimal", "workspace")) else 1e-8
            np.testing.assert_allclose(b, a, rtol=1e-7, atol=scale * size, err_msg=key)
        else:
            np.testing.assert_array_equal(b, a, err_msg=key)


def one_by_one(exo, angles, **query):
    """Single poses, and two halves of the stack."""
    poses = exo.pose(*angles)
    singles = [exo.reaction(poses[k], **query) for k in range(len(poses))]
    halves = [exo.reaction(poses[rows], **query) for rows in (slice(0, 2), slice(2, None))]
    assert isinstance(poses, Rotation)
    return singles, halves
