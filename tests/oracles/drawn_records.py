"""Records of designs whose keys are drawn at random, to be written and read back."""

from dataclasses import is_dataclass
from inspect import signature

import numpy as np
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.core.files.toml_tables import toml_text
from exo_pin.design import Limb, LimbBody, LimbGuide, Shoulder, Tackle, WristGeometry
from exo_pin.muscle import (
    ChouHannaford,
    FestoLaw,
    ForceTable,
    PolynomialModel,
    Validity,
)
from exo_pin.muscle.io.model_files import parameter_content

COUNT = 60


class Drawn:
    """Records with each optional field left out in half of the draws, and which were given."""

    def __init__(self, seed):
        self.rng, self.given = np.random.default_rng(seed), set()

    def number(self, low=0.1, high=1.0):
        return float(self.rng.uniform(low, high))

    def text(self):
        return "".join(self.rng.choice(list("abc Ωé\"'\\\n#=[]"), 6))

    def record(self, kind, optional, *values, **required):
        """A record with the given values, and with each of ``optional``, which make their values, or without it."""
        chosen = {name: made() for name, made in optional.items() if self.rng.random() < 0.5}
        self.given |= {(kind, name) for name in (*chosen, *required)}
        return kind(*values, **required, **chosen)

    def stiffness(self, size=3):
        root = self.rng.normal(size=(size, size))
        return 10.0 * (root @ root.T + np.eye(size))


def design(draw):
    """A design of all that its file can hold."""
    rng, count = draw.rng, int(draw.rng.integers(3, 5))
    turn, side = Rotation.from_rotvec(rng.normal(size=3)), str(rng.choice(["left", "right"]))
    if rng.random() < 0.5:
        angles = np.sort(rng.uniform(0.0, 6.0, count))
        geometry = WristGeometry.from_circles(*rng.uniform(0.05, 0.2, 4), angles, rng.permutation(angles), side)
        geometry = geometry.replace(neutral=turn) if rng.random() < 0.5 else geometry
    else:
        axes = {name: lambda: rng.normal(size=3) for name in ("base_axis", "platform_axis")}
        geometry = draw.record(WristGeometry, axes | {"neutral": lambda: turn}, *0.2 * rng.normal(size=(2, count, 3)))
    parts = {
        "arm": lambda: arm(draw),
        "limbs": lambda: tuple(limb(draw) for _ in range(count)),
        "shoulder": lambda: shoulder(draw),
        "gravity": lambda: rng.normal(size=3),
        "name": draw.text,
        "title": draw.text,
        "sources": lambda: {"arm": draw.text(), "geometry": "b"},
        "estimated": lambda: ("arm.mass", draw.text()),
        "interfaces": lambda: interfaces(draw),
        "measures": lambda: ("lengths", "arm"),
    }
    return draw.record(ep.Mechanism, parts, geometry, side=side)


def shoulder(draw):
    parts = {"abduction_centre": draw.number, "half_diagonal": draw.number, "stiffness": draw.stiffness}
    return draw.record(Shoulder, parts)


def interfaces(draw):
    def spring():
        at = {"at": lambda: 0.1 * draw.rng.normal(size=3), "source": draw.text}
        return draw.record(ep.Interface, at, draw.stiffness(6))

    return draw.record(ep.Interfaces, {"harness": spring, "cuff": spring, "cuff_area": lambda: 0.01})


def guide(draw):
    names = ("joint_stiffness", "joint_twist_stiffness", "largest_bending_moment", "largest_torque")
    return draw.record(LimbGuide, dict.fromkeys(names, draw.number), 40.0, 30.0)


def limb(draw):
    def body():
        return LimbBody.rod(draw.number(), draw.number(), 0.01 * draw.number())

    parts = {
        "kind": lambda: "SPS",
        "base_body": body,
        "platform_body": body,
        "stroke": lambda: draw.record(ep.Stroke, {"end_fitting": draw.number}, draw.number(), 0.75, 1.05),
        "joint_limit": draw.number,
        "joint_straight": lambda: tuple(draw.rng.normal(size=3).tolist()),
        "guide": lambda: guide(draw),
        "actuator": lambda: actuator(draw),
    }
    return draw.record(Limb, parts)


def actuator(draw):
    common = dict.fromkeys(("speed_limit", "power_limit", "travel_limit", "play", "resolution"), draw.number)
    common["pull_limit"] = lambda: draw.number(10.0, 99.0)
    kind = draw.rng.integers(3)
    if kind == 0:
        return draw.record(ep.Actuator, common | {"push_limit": draw.number}, "linear")
    if kind == 1:

        def tackle():
            return draw.record(Tackle, {"count": lambda: 2}, 2.0, draw.number(), law(draw), 4e5)

        return draw.record(ep.Actuator, common | {"least_tension": draw.number, "tackle": tackle}, "cable")
    speed = {"speed_limit": draw.number}
    return draw.record(ep.Actuator, speed, "pneumatic muscle", force_law=law(draw), supply_pressure=4e5)


def law(draw):
    """A published law by its name, or one of its own."""
    return "best" if draw.rng.random() < 0.5 else toml_text(parameter_content(muscle(draw)))


def arm(draw):
    kind, sized = int(draw.rng.integers(4)), {"elbow_flexion": draw.number, "payload": draw.number}
    sized |= {"arm_girth": lambda: 0.2 + 0.1 * draw.rng.random(), "clothing": lambda: 0.05 * draw.rng.random()}
    person = ep.Arm.of_wearer(draw.record(ep.Wearer, sized, 1.75, 75.0, "male"))
    if kind == 0:
        return person
    if kind == 1:
        parts = {
            "inertia": lambda: 1e-3 * np.eye(3),
            "device": lambda: True,
            "body_mass": lambda: 75.0,
            "wearer": lambda: ep.Wearer(1.6, 60.0, "female"),
        }
        return draw.record(ep.Arm, parts, draw.number(), 0.3 * draw.rng.normal(size=3))
    device = ep.Arm(0.4, [0, 0, -0.1], 1e-3 * np.eye(3), device=True)
    return device + (person if kind == 2 else ep.Arm(2.0, [0, 0, -0.3], body_mass=75.0))


def left(draw):
    """Optional fields of the records drawn that were in none of them."""
    missing = set()
    for kind in {kind for kind, _ in draw.given if is_dataclass(kind)}:
        parameters = signature(kind).parameters
        names = {name for name in parameters if parameters[name].default is not parameters[name].empty}
        missing |= {name for name in names if (kind, name) not in draw.given}
    return missing


def owners(arm):
    """Of each part: whose it is, and the person's mass."""
    return None if arm is None else [(part.body_mass, part.wearer and vars(part.wearer)) for part in arm.parts]


def muscle(draw):
    """A static model of any form that is written."""
    capability = {"capability": lambda: (draw.number(), -3.0), "basis": draw.text}
    validity = draw.record(Validity, capability, strain=(0.0, draw.number()), pressure=(1e5, 4e5))
    common = {"name": draw.text(), "reference_length": 0.3, "validity": validity}
    texts = {"source": draw.text, "notes": lambda: (draw.text(), "b")}
    form = draw.rng.integers(4)
    if form == 0:
        powers = {(int(i), int(j)): draw.number() for i, j in draw.rng.integers(0, 3, (4, 2))}
        return draw.record(PolynomialModel, texts, coefficients=powers, **common)
    if form == 1:
        return draw.record(FestoLaw, texts, largest_strain=0.1667, **common)
    if form == 2:
        table = {"strains": (-0.1, 2.0), "pressures": (0.0, 1e6), "forces": draw.rng.uniform(-9.0, 99.0, (2, 2))}
        return draw.record(ForceTable, texts, **table, **common)
    return draw.record(ChouHannaford, texts, braid_length=0.4, turns=2.0, **common)
