"""Named mechanisms in space with known answers: the agile eye, the delta robot, the Stewart platform."""

import numpy as np
from mechanisms import Named, Z, placed, unit
from scipy.spatial.transform import Rotation

from exo_pin.chain import ClosedChain, Closure, Closures, Placement, Roles
from exo_pin.chain.formats.urdf.urdf_writing import Body, Document


def agile_eye() -> Named:
    """Spherical 3RRR with right angles everywhere: base axes x, y, z, middle axes y, z, x, platform axes z, x, y."""
    document = Document("agile-eye")
    document.link("ground", None)
    axes, closures = np.eye(3), []
    for i in range(3):
        u, w, v = axes[i], axes[(i + 1) % 3], axes[(i + 2) % 3]
        for name in (f"proximal_{i}", f"distal_{i}", *(["platform"] if i == 0 else [])):
            document.link(name, Body(0.3, 0.05 * u, 0.001 * np.eye(3)))
        document.joint(f"motor_{i}", "revolute", "ground", f"proximal_{i}", np.zeros(3), u, [-3, 3])
        document.joint(f"middle_{i}", "revolute", f"proximal_{i}", f"distal_{i}", np.zeros(3), w, [-3, 3])
        if i == 0:
            document.joint("tip_0", "revolute", "distal_0", "platform", np.zeros(3), v, [-3, 3])
        else:
            closures.append(Closure(f"tip_{i}", "revolute", f"distal_{i}", "platform", axis=tuple(v)))
    roles = Roles(actuated=("motor_0", "motor_1", "motor_2"), arm="platform", reference_point="platform")
    return Named(document.text(), Closures("agile-eye", closures=tuple(closures), roles=roles), np.zeros(7))


#: The delta's base radius, arm, rod, platform radius, and half the distance between the rods of a pair, m.
DELTA = (0.2, 0.25, 0.5, 0.06, 0.04)


def delta_points(i: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Of arm i at rest, arms level: hinge, its axis, elbow, the platform's joint, the platform's centre."""
    r_base, arm, rod, r_platform, _ = DELTA
    angle = 2 * np.pi * i / 3
    ray, axis = np.array([np.cos(angle), np.sin(angle), 0.0]), np.array([-np.sin(angle), np.cos(angle), 0.0])
    elbow = (r_base + arm) * ray
    out = r_base + arm - r_platform
    centre = np.array([0.0, 0.0, -np.sqrt(rod**2 - out**2)])
    return r_base * ray, axis, elbow, centre + r_platform * ray, centre


def delta(legs: str = "rods") -> Named:
    """A delta robot at rest, its three arms level.

    ``legs``: "rods" has three pairs of rods between ball joints, as distance closures, and a floating platform;
    "universal" and "rigid" have one rod a leg with a universal joint at either end, whose parallel axes keep the
    platform level as a pair of rods does: the first leg carries the platform, the others close onto it by a
    universal joint, or with all their joints in the tree.
    """
    document = Document(f"delta-{legs}")
    document.link("ground", None)
    closures = []
    body = Body(0.2, np.zeros(3), 0.0005 * np.eye(3))
    first, centre = delta_points(0)[3:]
    if legs == "rods":
        document.link("platform", body)
        document.joint("flight", "floating", "ground", "platform", np.zeros(3), Z)
    for i in range(3):
        hinge, axis, elbow, joint, _ = delta_points(i)
        document.link(f"arm_{i}", body)
        document.joint(f"motor_{i}", "revolute", "ground", f"arm_{i}", hinge, axis, [-1.5, 1.5])
        if legs == "rods":
            for side, sign in (("left", 1.0), ("right", -1.0)):
                apart = sign * DELTA[4] * axis
                ends = placed(elbow - hinge + apart), placed(joint - centre + apart)
                closures.append(
                    Closure(f"rod_{i}_{side}", "distance", f"arm_{i}", "platform", *ends, distance=DELTA[2])
                )
            continue
        along = unit(joint - elbow)
        second = unit(np.cross(axis, along))
        document.link(f"cross_{i}", Body(0.01, np.zeros(3), 1e-5 * np.eye(3)))
        document.link(f"rod_{i}", body)
        document.joint(f"elbow_{i}_swing", "revolute", f"arm_{i}", f"cross_{i}", elbow - hinge, axis, [-3, 3])
        document.joint(f"elbow_{i}_tilt", "revolute", f"cross_{i}", f"rod_{i}", np.zeros(3), second, [-3, 3])
        if i == 0 or legs == "rigid":
            document.link(f"tip_cross_{i}", Body(0.01, np.zeros(3), 1e-5 * np.eye(3)))
            last = "platform" if i == 0 else f"tip_{i}"
            document.link(last, body)
            document.joint(f"tip_{i}_tilt", "revolute", f"rod_{i}", f"tip_cross_{i}", joint - elbow, second, [-3, 3])
            document.joint(f"tip_{i}_swing", "revolute", f"tip_cross_{i}", last, np.zeros(3), axis, [-3, 3])
        if i and legs == "rigid":
            closures.append(Closure(f"leg_{i}", "rigid", f"tip_{i}", "platform", placement_b=placed(joint - first)))
        elif i:
            # The rod turns about `second`, the platform about `axis`: x of frame a and y of frame b.
            frame = Rotation.from_matrix(np.stack([second, axis, np.cross(second, axis)], axis=-1))
            ends = placed(joint - elbow, frame), placed(joint - first, frame)
            closures.append(Closure(f"leg_{i}", "universal", f"rod_{i}", "platform", *ends))
    q = np.zeros({"rods": 10, "universal": 11, "rigid": 15}[legs])
    if legs == "rods":
        chain_order = ClosedChain.from_urdf(document.text(), Closures(document.name))
        q = chain_order.neutral()
        q[chain_order.configuration_slice("flight")] = [*centre, 0, 0, 0, 1]
    roles = Roles(actuated=("motor_0", "motor_1", "motor_2"), arm="platform")
    return Named(document.text(), Closures(document.name, closures=tuple(closures), roles=roles), q)


def stewart() -> Named:
    """A 6-UPS platform, base pivots on 0.4 m, platform pivots on 0.2 m, 0.5 m up and a little shifted and turned.

    Every leg has a universal joint on the ground and a slide; it ends in a ball joint at the platform. A slide at
    zero leaves the leg at its length at rest.
    """
    document = Document("stewart")
    document.link("ground", None)
    document.link("platform", Body(2.0, np.zeros(3), 0.02 * np.eye(3)))
    pose = Rotation.from_rotvec([0.1, -0.2, 0.15]), np.array([0.03, -0.02, 0.5])
    document.joint("flight", "floating", "ground", "platform", np.zeros(3), Z)
    closures = []
    base, platform = stewart_points()
    for i in range(6):
        tip = pose[0].apply(platform[i]) + pose[1]
        along = unit(tip - base[i])
        first = unit(np.cross(along, [0.3, 1.0, 0.2]))
        second = np.cross(along, first)
        for part in ("cross", "lower", "upper"):
            document.link(f"{part}_{i}", Body(0.1, np.zeros(3), 1e-4 * np.eye(3)))
        document.joint(f"base_{i}_x", "revolute", "ground", f"cross_{i}", base[i], first, [-3, 3])
        document.joint(f"base_{i}_y", "revolute", f"cross_{i}", f"lower_{i}", np.zeros(3), second, [-3, 3])
        document.joint(f"slide_{i}", "prismatic", f"lower_{i}", f"upper_{i}", tip - base[i], along, [-0.3, 0.3])
        closures.append(Closure(f"ball_{i}", "spherical", f"upper_{i}", "platform", Placement(), placed(platform[i])))
    roles = Roles(actuated=tuple(f"slide_{i}" for i in range(6)), arm="platform")
    bare = ClosedChain.from_urdf(document.text(), Closures("bare"))
    q = bare.neutral()
    q[bare.configuration_slice("flight")] = [*pose[1], *pose[0].as_quat()]
    return Named(document.text(), Closures("stewart", closures=tuple(closures), roles=roles), q)


def stewart_points() -> tuple[np.ndarray, np.ndarray]:
    """Pivots of the 6-UPS platform, shape (6, 3), in the ground and in the platform."""
    base = np.radians([10, 110, 130, 230, 250, 350])
    platform = np.radians([50, 70, 170, 190, 290, 310])
    zero = np.zeros(6)
    return (
        0.4 * np.stack([np.cos(base), np.sin(base), zero], axis=-1),
        0.2 * np.stack([np.cos(platform), np.sin(platform), zero], axis=-1),
    )
