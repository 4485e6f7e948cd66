"""Small named mechanisms with known answers, as URDF text, closures and a closed configuration found by hand."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from exo_pin.chain import TYPES, ClosedChain, Closure, Closures, Placement, Roles
from exo_pin.chain.formats.urdf.urdf_writing import Body, Document
from exo_pin.design import Arm, Limb, LimbBody, Mechanism, WristGeometry

Z = (0.0, 0.0, 1.0)


class Named(NamedTuple):
    urdf: str
    closures: Closures
    q: np.ndarray  # closed, by hand

    def chain(self) -> ClosedChain:
        return ClosedChain.from_urdf(self.urdf, self.closures)


def rod(length: float, mass: float = 1.0) -> Body:
    """A thin rod along x from the link's origin; 1 mm thick, so that its inertia is positive definite."""
    across = mass * length**2 / 12
    return Body(mass, np.array([length / 2, 0.0, 0.0]), np.diag([1e-6, across, across + 1e-7]))


def _planar(name: str, links: list[tuple[str, str, tuple[float, float], float]]) -> Document:
    """Links along their own x, each on a hinge about z: (link, parent, hinge's place in the parent, length)."""
    document = Document(name)
    document.link("ground", None)
    for link, parent, (x, y), length in links:
        document.link(link, rod(length))
        document.joint(f"{link}_hinge", "revolute", parent, link, [x, y, 0.0], Z, [-6.3, 6.3])
    return document


def _at(x: float) -> Placement:
    return Placement((x, 0.0, 0.0))


def four_bar(cut: str = "joint") -> Named:
    """Ground pivots (0, 0) and (0.4, 0); crank 0.3 upright; its tip (0, 0.3) joined to the rocker's tip (0.7, 0.4).

    The coupler then runs along (7, 1)/√50 and the rocker along (3, 4)/5. ``cut``: "joint" opens the loop at the
    rocker's tip (three rows, of which the one across the plane is redundant), "link" in the middle of the rocker
    (six rows, three redundant).
    """
    coupler = float(np.sqrt(0.5))
    crank_angle, coupler_angle, rocker_angle = np.pi / 2, np.arctan2(1.0, 7.0), np.arctan2(4.0, 3.0)
    links = [("crank", "ground", (0.0, 0.0), 0.3), ("coupler", "crank", (0.3, 0.0), coupler)]
    q = [crank_angle, coupler_angle - crank_angle]
    roles = Roles(actuated=("crank_hinge",))
    if cut == "joint":
        links.append(("rocker", "ground", (0.4, 0.0), 0.5))
        closure = Closure("tip", "spherical", "coupler", "rocker", _at(coupler), _at(0.5))
        return Named(
            _planar("four_bar", links).text(),
            Closures("four_bar", closures=(closure,), roles=roles),
            np.array([*q, rocker_angle]),
        )
    # The upper half of the rocker hangs on the coupler, pointing down to the lower half.
    links += [("upper", "coupler", (coupler, 0.0), 0.25), ("lower", "ground", (0.4, 0.0), 0.25)]
    turned = Placement((0.25, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0))
    closure = Closure("middle", "rigid", "upper", "lower", _at(0.25), turned)
    q_link = np.array([*q, rocker_angle - np.pi - coupler_angle, rocker_angle])
    return Named(
        _planar("four_bar_link", links).text(), Closures("four_bar_link", closures=(closure,), roles=roles), q_link
    )


def five_bar() -> Named:
    """Bases (∓0.1, 0), elbows (∓0.22, 0.16), tip (0, 0.325): cranks 0.2 and forearms 0.275 of 3-4-5 triangles."""
    links = [
        ("left_crank", "ground", (-0.1, 0.0), 0.2),
        ("left_forearm", "left_crank", (0.2, 0.0), 0.275),
        ("right_crank", "ground", (0.1, 0.0), 0.2),
        ("right_forearm", "right_crank", (0.2, 0.0), 0.275),
    ]
    left, right = np.arctan2(4.0, -3.0), np.arctan2(4.0, 3.0)
    left_forearm, right_forearm = np.arctan2(3.0, 4.0), np.arctan2(3.0, -4.0)
    closure = Closure("tip", "spherical", "left_forearm", "right_forearm", _at(0.275), _at(0.275))
    roles = Roles(actuated=("left_crank_hinge", "right_crank_hinge"))
    q = np.array([left, left_forearm - left, right, right_forearm - right])
    document = _planar("five_bar", links)
    document.link("tip", None)
    document.joint("tip_weld", "fixed", "left_forearm", "tip", [0.275, 0.0, 0.0], Z)
    return Named(document.text(), Closures("five_bar", closures=(closure,), roles=roles), q)


def random_loop(kind: str, seed: int = 6) -> Named:
    """Two arms of random hinges and slides from the ground, closed at random frames by one closure of the given type.

    The closure is not in its rest position: what it allows has moved by random amounts.
    """
    rng = np.random.default_rng(seed)
    document = Document(f"loop-{kind}")
    document.link("ground", None)
    for side, count in (("left", 4), ("right", 3)):
        parent = "ground"
        for k in range(count):
            link, axis = f"{side}_{k}", rng.normal(size=3)
            document.link(link, Body(1.0, rng.normal(size=3) * 0.1, 0.01 * np.eye(3)))
            joint = "prismatic" if (side, k) == ("left", 2) else "revolute"
            origin = rng.normal(size=3) * 0.3
            document.joint(f"{link}_joint", joint, parent, link, origin, axis / np.linalg.norm(axis), [-3, 3])
            parent = link
    rules = TYPES[kind]
    axis = tuple(float(x) for x in unit(rng.normal(size=3))) if rules.has_axis else None
    place = Placement(tuple(rng.normal(size=3) * 0.2), tuple(Rotation.random(rng=rng).as_quat()))
    bare = Closure("loop", "spherical", "left_3", "right_2", place)
    q = rng.uniform(-1.0, 1.0, 7)
    if rules.is_coupling:
        return _coupled_arms(rng, document, q)
    open_chain = ClosedChain.from_urdf(document.text(), Closures(document.name, closures=(bare,)))
    poses = open_chain.placements(q)
    turned, moved = (Rotation.from_quat(place.quaternion), np.array(place.translation))
    R_a = Rotation.from_matrix(poses["left_3"].rotation) * turned
    p_a = poses["left_3"].rotation @ moved + poses["left_3"].translation
    own = Rotation.identity() if axis is None else Rotation.align_vectors([axis], [Z])[0]
    slide, angle, angle_2 = -0.1, 0.7, -0.4
    # Where b stands seen from a: back along what the joint has done, in the closure's own axes.
    turns = {
        "xyz": Rotation.identity(),
        "xy": Rotation.from_rotvec([0, 0, -angle]),
        "cross": (Rotation.from_rotvec([0, angle, 0]) * Rotation.from_rotvec([angle_2, 0, 0])).inv(),
        "": Rotation.random(rng=rng),
    }
    shift = np.array([0.0 if axis in rules.linear else slide for axis in "xyz"])
    if rules.linear == "length":
        shift = 0.3 * unit(rng.normal(size=3))
    rotation, shift = own * turns[rules.angular] * own.inv(), own.apply(shift)
    R_b, p_b = R_a * rotation, p_a + R_a.apply(shift)
    carrier = poses["right_2"]
    local = Rotation.from_matrix(carrier.rotation.T) * R_b
    at_b = Placement(tuple(carrier.rotation.T @ (p_b - carrier.translation)), tuple(local.as_quat()))
    distance = 0.3 if rules.linear == "length" else None
    closure = Closure("loop", kind, "left_3", "right_2", place, at_b, axis, distance)
    names = [f"left_{k}_joint" for k in range(4)] + [f"right_{k}_joint" for k in range(3)]
    roles = Roles(actuated=tuple(names[: 7 - closure.rows]))
    return Named(document.text(), Closures(document.name, closures=(closure,), roles=roles), q)


def _coupled_arms(rng: np.random.Generator, document: Document, q: np.ndarray) -> Named:
    """The two arms of :func:`random_loop` with a hinge that follows the slide of the other arm by a cubic."""
    bend, r_a, r_b = rng.uniform(0.5, 1.5, 3), 0.2, -0.3
    x = q[2] - r_a
    constant = q[5] - r_b - (bend[0] * x + bend[1] * x**2 + bend[2] * x**3)
    closure = Closure(
        "loop",
        "coupling",
        "left_2_joint",
        "right_1_joint",
        polynomial=(float(constant), *bend.tolist()),
        references=(r_a, r_b),
    )
    driven = [f"left_{k}_joint" for k in range(4)] + ["right_0_joint", "right_2_joint"]
    roles = Roles(actuated=tuple(driven))
    return Named(document.text(), Closures(document.name, closures=(closure,), roles=roles), q)


def planar_3rrr(radial: bool = False) -> Named:
    """Base pivots on a circle of 0.3 m, platform pivots on one of 0.1 m, both at 90°, 210° and 330°, platform at rest.

    The elbows stand beside the line from pivot to pivot. ``radial``: on the ray through the pivots, so that the
    distal links' lines meet at the centre and the platform can turn with its cranks locked.
    """
    document = Document("3rrr-radial" if radial else "3rrr")
    document.link("ground", None)
    names = ("proximal", "distal", "platform")
    closures = []
    for i, angle in enumerate(np.radians([90.0, 210.0, 330.0])):
        ray = np.array([np.cos(angle), np.sin(angle), 0.0])
        across = np.array([-ray[1], ray[0], 0.0])
        base, tip = 0.3 * ray, 0.1 * ray
        if radial:
            # The crank stands across the ray: the base pivot is beside it.
            elbow = 0.25 * ray
            base = elbow + 0.12 * across
        else:
            elbow = 0.2 * ray + 0.1 * across
        for name in names[:2] if i else names:
            link = name if name == "platform" else f"{name}_{i}"
            document.link(link, Body(0.5, np.zeros(3), 0.001 * np.eye(3)))
        document.joint(f"crank_{i}", "revolute", "ground", f"proximal_{i}", base, Z, [-3, 3])
        document.joint(f"elbow_{i}", "revolute", f"proximal_{i}", f"distal_{i}", elbow - base, Z, [-3, 3])
        if i == 0:
            document.joint("tip_0", "revolute", "distal_0", "platform", tip - elbow, Z, [-3, 3])
            first = tip
        else:
            ends = placed(tip - elbow), placed(tip - first)
            closures.append(Closure(f"tip_{i}", "revolute", f"distal_{i}", "platform", *ends))
    roles = Roles(actuated=("crank_0", "crank_1", "crank_2"), arm="platform")
    return Named(document.text(), Closures(document.name, closures=tuple(closures), roles=roles), np.zeros(7))


def parallelogram(angle: float = 1.0) -> Named:
    """Three parallel cranks of 0.2 m, 0.3 m apart, under one bar: one crank more than it needs."""
    document = Document("parallelogram")
    document.link("ground", None)
    for i in range(3):
        document.link(f"crank_{i}", rod(0.2))
        document.joint(f"hinge_{i}", "revolute", "ground", f"crank_{i}", [0.3 * i, 0.0, 0.0], Z, [-3, 3])
    document.link("bar", rod(0.6))
    document.joint("tip_0", "revolute", "crank_0", "bar", [0.2, 0.0, 0.0], Z, [-3, 3])
    closures = tuple(Closure(f"tip_{i}", "spherical", f"crank_{i}", "bar", _at(0.2), _at(0.3 * i)) for i in (1, 2))
    roles = Roles(actuated=("hinge_0",), arm="bar")
    bare = ClosedChain.from_urdf(document.text(), Closures("bare"))
    q = bare.neutral()
    for name in bare.model.names[1:]:
        q[bare.configuration_slice(name)] = -angle if name == "tip_0" else angle
    return Named(document.text(), Closures("parallelogram", closures=closures, roles=roles), q)


def enlarged(chain: ClosedChain, factor: float) -> ClosedChain:
    """The same mechanism with all its lengths times a factor."""
    model = chain.model.copy()
    for joint in range(1, model.njoints):
        model.jointPlacements[joint].translation *= factor
    for frame in model.frames:
        frame.placement.translation *= factor
    closures = tuple(
        replace(
            closure,
            placement_a=placed(factor * np.array(closure.placement_a.translation)),
            placement_b=placed(factor * np.array(closure.placement_b.translation)),
        )
        for closure in chain.closures
    )
    return ClosedChain(model, replace(chain.description, closures=closures))


def with_free_hinge(named: Named) -> ClosedChain:
    """A mechanism with a body more that turns freely on its last joint's, and carries nothing."""
    bare = named.chain()
    model = bare.model.copy()
    last = model.addJoint(model.njoints - 1, pin.JointModelRX(), pin.SE3.Identity(), "free")
    model.appendBodyToJoint(last, pin.Inertia(1.0, np.zeros(3), np.eye(3)), pin.SE3.Identity())
    return ClosedChain(model, bare.description)


def sliders(length: float) -> Named:
    """Slides along x and y, one on the other, whose end is moved along (0.6, 0.8) by a third, ``length`` above them."""
    document = Document("sliders")
    document.link("ground", None)
    for name, parent, axis in (("x", "ground", (1, 0, 0)), ("y", "x", (0, 1, 0)), ("both", "ground", (0.6, 0.8, 0))):
        document.link(name, Body(1.0, np.zeros(3), np.eye(3)))
        document.joint(f"slide_{name}", "prismatic", parent, name, [0.0, 0.0, 0.0], axis, [-length, length])
    at = Placement((0.0, 0.0, length))
    end = Closure("end", "spherical", "y", "both", at, at)
    return Named(document.text(), Closures("sliders", closures=(end,)), np.zeros(3))


def placed(point: np.ndarray, rotation: Rotation | None = None) -> Placement:
    quaternion = (0.0, 0.0, 0.0, 1.0) if rotation is None else tuple(rotation.as_quat().tolist())
    return Placement(tuple(np.asarray(point).tolist()), quaternion)


def unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)


def random_wrist(seed: int, kinds: str, with_masses: bool = False) -> Mechanism:
    """A wrist with limbs of the given kinds ("U" for UPU, "S" for SPS), joints at random near two spheres."""
    rng = np.random.default_rng(seed)
    count = len(kinds)
    spread = np.linspace(0.0, 2 * np.pi, count, endpoint=False) + rng.uniform(-0.3, 0.3, count)
    base = np.stack([0.13 * np.cos(spread), rng.uniform(-0.1, -0.05, count), 0.13 * np.sin(spread)], axis=-1)
    platform = np.stack([0.11 * np.cos(spread), 0.11 * np.sin(spread), rng.uniform(-0.25, -0.15, count)], axis=-1)
    arm = Arm(2.5, [0.01, 0.02, -0.22], np.diag([0.03, 0.028, 0.004]))
    halves = (LimbBody.rod(0.3, 0.12, 0.01), LimbBody.rod(0.2, 0.15, 0.015)) if with_masses else (None, None)
    limbs = tuple(Limb("UPU" if kind == "U" else "SPS", *halves) for kind in kinds)
    return Mechanism(WristGeometry(base, platform), arm=arm, limbs=limbs, name=f"random-{seed}")


def flat_parallelogram():
    """URDF and closures of a parallelogram on its line: crank 0.2 m, coupler 0.4, rocker 0.2, ground 0.4."""
    links = [
        ("crank", "ground", (0.0, 0.0), 0.2),
        ("coupler", "crank", (0.2, 0.0), 0.4),
        ("rocker", "ground", (0.4, 0.0), 0.2),
    ]
    closures = four_bar().closures
    (closure,) = closures.closures
    tips = replace(closure, placement_a=_at(0.4), placement_b=_at(0.2))
    return _planar("parallelogram", links).text(), replace(closures, closures=(tips,))
