"""Files that the package writes: records with every optional key drawn at random come back equal."""

from dataclasses import is_dataclass, replace
from inspect import signature

import numpy as np
import pytest
from handed_devices import BASES, handed
from measured_devices import poses as human_poses
from places import URDF
from same_records import same
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.chain import (
    Closure,
    Closures,
    JointProperties,
    LimbRole,
    Placement,
    Roles,
    Root,
    read_closures,
    write_closures,
)
from exo_pin.chain.formats.restated import BY_POSITION, BY_VELOCITY, JointRestated, Restated
from exo_pin.control import MeasuredRun, read_run, write_run
from exo_pin.core.files.toml_tables import parse_toml, toml_text
from exo_pin.design import Limb, LimbBody, LimbGuide, Shoulder, Tackle, WristGeometry, read_mechanism, write_mechanism
from exo_pin.device import Brake, ConstantForce, Drive, GuidedSlide, LinearSpring, Route, Spring, TableLaw
from exo_pin.device.files.robot_files import robot_content, robot_tables
from exo_pin.muscle import (
    ChouHannaford,
    ConstantFriction,
    Damping,
    DynamicModel,
    FestoLaw,
    ForceTable,
    LoadDependentFriction,
    PolynomialModel,
    Validity,
    load_dynamic,
    load_parameters,
    save_dynamic,
    save_parameters,
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


def test_designs_come_back(tmp_path):
    draw, path = Drawn(1), tmp_path / "drawn.toml"
    for _ in range(COUNT):
        mechanism = design(draw)
        write_mechanism(mechanism, path)
        again = read_mechanism(path)
        assert same(again, mechanism)
        assert str(owners(again.arm)) == str(owners(mechanism.arm))
        assert again.arm is None or again.arm.body_mass == mechanism.arm.body_mass
        before = path.read_bytes()
        write_mechanism(again, path)
        assert path.read_bytes() == before
    # Circles make their points, degrees are another unit of a field, and of a muscle no scaled law is written.
    assert left(draw) <= {"degrees", "circles", "nominal_length"}


def test_a_design_whose_limbs_are_folded_at_rest_comes_back(tmp_path):
    """Its neutral pose is another; a reader that first makes it with the arm hanging refuses it."""
    base = np.array([[0.1, 0.0, 0.1], [-0.1, 0.1, 0.1], [0.0, 0.2, -0.1]])
    geometry = WristGeometry(base, -0.5 * base, neutral=Rotation.from_rotvec([0.3, 0.2, -0.5]))
    ep.ShoulderExo(geometry).save(tmp_path / "mine.toml")
    assert same(ep.load(tmp_path / "mine.toml").geometry, geometry)


def test_the_body_mass_of_a_single_arm_is_read(tmp_path):
    text = ep.design.preset_file("appendix-d")
    (tmp_path / "mine.toml").write_text(text.replace("[arm]", "[arm]\nbody_mass_kg = 81.0"))
    assert ep.load(tmp_path / "mine.toml").arm.body_mass == 81.0
    sized = "[arm]\nbody_mass_kg = 81.0\nwearer = { height_m = 1.75, mass_kg = 75.0, sex = 'male' }\n"
    design = text[: text.index("[arm]")] + sized
    (tmp_path / "mine.toml").write_text(design)
    with pytest.raises(ep.FileFormatError, match=r"body_mass_kg: given twice: the wearer weighs 75 kg"):
        ep.load(tmp_path / "mine.toml")


def closure(draw, number):
    """A loop of any type, in different frames."""
    rng, name = draw.rng, f"loop {number}"
    if rng.random() < 0.3:
        polynomial = tuple(rng.normal(size=3).tolist())
        return draw.record(
            Closure, {"references": lambda: (0.1, 0.2)}, name, "coupling", "a", "b", polynomial=polynomial
        )

    def place():
        parts = {
            "translation": lambda: tuple(rng.normal(size=3).tolist()),
            "quaternion": lambda: tuple(Rotation.random(rng=rng).as_quat().tolist()),
        }
        return draw.record(Placement, parts)

    kind = str(rng.choice(["rigid", "spherical", "revolute", "prismatic", "cylindrical", "distance"]))
    parts = {"placement_a": place, "placement_b": place}
    if kind in ("revolute", "prismatic", "cylindrical"):
        parts["axis"] = lambda: (0.0, 0.6, 0.8)
    return draw.record(Closure, parts, name, kind, "a", "universe", **({"distance": 0.3} if kind == "distance" else {}))


def joint(draw, number):
    """What a robot's file cannot say of a joint."""
    one = {"spring_reference": lambda: (draw.number(),), "armature": lambda: (draw.number(),)}
    unit = str(draw.rng.choice(["rad", "m", "ball"]))
    if unit == "ball":
        return draw.record(JointProperties, {"type": lambda: "spherical"}, f"joint {number}")
    return draw.record(JointProperties, one, f"joint {number}", stiffness=draw.number(), unit=unit)


def test_closures_come_back(tmp_path):
    draw, path = Drawn(2), tmp_path / "drawn.closures.toml"
    for _ in range(COUNT):
        limb = LimbRole("limb", str(draw.rng.choice(["UPU", "SPS"])), "slide", "platform", "loop 0")
        root = {
            "joint": lambda: "spherical",
            "name": lambda: "ball",
            "gravity": lambda: tuple(draw.rng.normal(size=3).tolist()),
        }
        roles = dict.fromkeys(("shoulder", "arm", "reference_point", "cuff"), draw.text)
        roles |= {"actuated": lambda: ("a", "b"), "limbs": lambda limb=limb: (limb,)}
        parts = {
            "name": draw.text,
            "root": lambda root=root: draw.record(Root, root),
            "roles": lambda roles=roles: draw.record(Roles, roles),
            "joints": lambda: tuple(joint(draw, k) for k in range(2)),
            "left_out": lambda: ("one", draw.text()),
            "tolerance": lambda: 1e-6,
        }
        closures = draw.record(Closures, parts, closures=tuple(closure(draw, k) for k in range(3)))
        write_closures(closures, path)
        assert read_closures(path) == closures
    # No part of a closures file: what a reader finds beside it.
    assert left(draw) <= {"rounding", "shapes", "cables"}


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


def numbers(record):
    """Of a record, shape (k,); fields without a value are NaN."""
    return np.concatenate([np.ravel(np.nan if value is None else value) for value in vars(record).values()])


@pytest.mark.full
def test_muscle_models_come_back(tmp_path):
    draw, path, digits = Drawn(3), tmp_path / "drawn.toml", {"rtol": 1e-15}
    for _ in range(COUNT):
        model = muscle(draw)
        save_parameters(model, path)
        read = load_parameters(path)
        assert (read.name, read.source, read.notes) == (model.name, model.source, model.notes)
        assert read.validity.basis == model.validity.basis
        for name in ("strain", "pressure", "capability"):
            own, other = getattr(model.validity, name), getattr(read.validity, name)
            assert (own is None) == (other is None)
            np.testing.assert_allclose(*(np.ravel(np.nan if x is None else x) for x in (other, own)), **digits)
        at = np.array([0.01, 0.03]), np.array([2e5, 3e5])
        np.testing.assert_allclose(*(each.force(*at, outside="mark").data for each in (read, model)), rtol=1e-13)
        sizes = draw.rng.uniform(0.1, 1.0, 6)
        law = ConstantFriction(sizes[0]) if draw.rng.random() < 0.5 else LoadDependentFriction(*sizes[:4])
        texts = {"source": draw.text, "notes": lambda: (draw.text(), "b")}
        moving = draw.record(
            DynamicModel, texts, name=draw.text(), static=model, friction=law, damping=Damping(*sizes[4:])
        )
        save_dynamic(moving, path)
        again = load_dynamic(path)
        assert (again.name, again.source, again.notes) == (moving.name, moving.source, moving.notes)
        np.testing.assert_allclose(numbers(again.friction), numbers(law), **digits)
        np.testing.assert_allclose(numbers(again.damping), numbers(moving.damping), **digits)
        assert again.static.validity == read.validity
    # A scaled muscle is an assumption, and refused.
    assert left(draw) <= {"nominal_length"}


def test_measured_runs_come_back(tmp_path):
    draw, path = Drawn(4), tmp_path / "run.csv"
    for _ in range(COUNT // 3):
        poses, lengths = human_poses(draw.rng, 5), draw.rng.uniform(0.2, 0.5, (5, 3))
        parts = {
            "times": lambda: np.sort(draw.rng.uniform(0.0, 9.0, 5)),
            "pressures": lambda: draw.rng.uniform(0.0, 4e5, (5, 2)),
        }
        run = draw.record(MeasuredRun, parts, poses, lengths)
        write_run(run, path, ["a comment"])
        again = read_run(path)
        np.testing.assert_allclose(again.poses.as_quat(), run.poses.as_quat(), atol=1e-15)
        for name in ("lengths", "times", "pressures"):
            own, other = getattr(run, name), getattr(again, name)
            assert (own is None) == (other is None)
            if own is not None:
                np.testing.assert_allclose(other, own, rtol=1e-15)


@pytest.mark.full
@pytest.mark.parametrize("seed", range(len(BASES)))
def test_devices_come_back(seed, tmp_path):
    exo = handed(seed)
    exo.save(tmp_path / "mine.toml")
    again = ep.load(tmp_path / "mine.toml").device
    for name in ("drives", "springs", "brakes", "guided_slides", "name", "title", "side", "sources"):
        assert getattr(again, name) == getattr(exo.device, name), name
    for one, other in ((again.interfaces, exo.device.interfaces), (again.shoulder, exo.device.shoulder)):
        assert same(one, other)
    assert len(again.soft_links) == len(exo.device.soft_links)
    assert owners(again.arm) == owners(exo.device.arm)


def drive(draw, name, turns=False, way=None):
    """A drive in a hinge, along a route, or in a slide that is a limb."""
    low, high = sorted(draw.rng.normal(size=2).tolist())
    parts = {"lower": lambda: low - 2.0, "upper": lambda: high + 2.0, "least": lambda: low, "greatest": lambda: high}
    parts |= dict.fromkeys(("speed_limit", "power_limit", "play", "resolution"), draw.number)
    if turns:
        return draw.record(Drive, parts, name, joint=name)
    parts |= {
        "actuator": lambda: actuator(draw),
        "stroke": lambda: draw.record(ep.Stroke, {"end_fitting": draw.number}, draw.number(), 0.75, 1.05),
    }
    if way is not None:
        return draw.record(Drive, parts, name, route=way)
    return draw.record(Drive, parts | {"zero_length": draw.number}, name, joint=name, pulls=True)


@pytest.mark.full
def test_drives_and_soft_parts_of_devices_come_back(tmp_path):
    draw, exo = Drawn(5), ep.load(URDF / "3rps-passive-ball.urdf")
    names = [each.joint for each in exo.device.drives]
    hinges = [name for name in map(str, exo.chain.model.names) if name.endswith("hinge")]
    arm = exo.chain.roles.arm
    for _ in range(COUNT // 6):
        way = Route.over(("universe", 0.1 * draw.rng.normal(size=3)), (arm, [0.0, 0.05, -0.2]))
        driven = [drive(draw, name) for name in names]
        driven += [drive(draw, name, turns=True) for name in hinges] + [drive(draw, "cable", way=way)]
        brakes = [draw.record(Brake, {"limit": draw.number}, f"brake of {name}", name) for name in (names[0], *hinges)]
        parts = {
            "cuff_area": lambda: 0.01,
            "cuff": lambda: ep.Interface(draw.stiffness(6), 0.1 * draw.rng.normal(size=3)),
        }
        changed = exo.device.replace(
            drives=tuple(driven),
            brakes=tuple(brakes),
            guided_slides=tuple(draw.record(GuidedSlide, {"guide": lambda: guide(draw)}, name) for name in names),
            interfaces=draw.record(ep.Interfaces, parts),
            shoulder=shoulder(draw),
        )
        ep.ShoulderExo.from_device(changed).save(tmp_path / "mine.toml")
        again = ep.load(tmp_path / "mine.toml").device
        for name in ("drives", "brakes", "guided_slides"):
            assert getattr(again, name) == getattr(changed, name), name
        for one, other in ((again.interfaces, changed.interfaces), (again.shoulder, changed.shoulder)):
            assert same(one, other)
    assert {name for kind, name in draw.given if kind in (Drive, Brake, GuidedSlide)} >= {
        name for kind in (Drive, Brake, GuidedSlide) for name in signature(kind).parameters
    } - {"name", "slide"}


def restated_joint(draw, name, nq, nv):
    """What a robot's file says otherwise of a joint, in its numbers of coordinates."""
    body = np.concatenate([[draw.number()], 0.1 * draw.rng.normal(size=3), draw.stiffness()[np.tril_indices(3)]])
    turn = Rotation.random(rng=draw.rng).as_quat() if nq == 4 else draw.rng.normal(size=nq)
    sizes = dict.fromkeys(BY_VELOCITY, nv) | dict.fromkeys(BY_POSITION, nq)
    chosen = [key for key in sizes if draw.rng.random() < 0.5]
    data = {key: tuple(draw.rng.uniform(0.1, 1.0, sizes[key]).tolist()) for key in chosen}
    draw.given |= {("data", key) for key in data}
    parts = {
        "called": lambda: f"{name} {draw.text()}",
        "zero": lambda: tuple(turn.tolist()),
        "inertia": lambda: tuple(body.tolist()),
    }
    return draw.record(JointRestated, parts, data=data)


@pytest.mark.parametrize("ending", [".xml", ".sdf", ".urdf"])
def test_what_a_device_file_says_of_its_robots_file_comes_back(ending):
    """Its table in_file with every key, where the arm hangs, and of other formats than URDF closures and joints."""
    draw, chain = Drawn(6), ep.load(URDF / "spherical-3rrr.urdf").chain
    model, own = chain.model, replace(chain.description, tolerance=1e-6, left_out=("fluid",))
    joints = [(str(model.names[k]), model.nqs[k], model.nvs[k]) for k in range(1, model.njoints)]
    for _ in range(COUNT // 3):
        names = {"frames": lambda: {draw.text(): "a", "b": draw.text()}}
        names |= {key: lambda: (draw.text(), "c") for key in ("helpers", "closing")}
        some = {name: restated_joint(draw, name, nq, nv) for name, nq, nv in joints if draw.rng.random() < 0.5}
        restated = draw.record(Restated, names, joints=some)
        rest = {name: draw.rng.normal(size=nq) for name, nq, _ in joints if draw.rng.random() < 0.5}
        content = robot_tables(ep.ClosedChain(model, own), restated, ending, rest)
        again = robot_content(parse_toml(toml_text(content), None))
        assert repr(again.restated) == repr(restated)
        assert {name: list(values) for name, values in again.rest.items()} == {k: v.tolist() for k, v in rest.items()}
        if ending != ".urdf":
            assert (again.own.closures, again.own.joints) == (own.closures, own.joints)
            assert (again.own.tolerance, again.own.left_out) == (own.tolerance, own.left_out)
    assert left(draw) == set()
    assert {key for kind, key in draw.given if kind == "data"} == {*BY_VELOCITY, *BY_POSITION}


@pytest.mark.full
def test_springs_on_joints_state_efforts(tmp_path):
    """Positive towards larger coordinates, as drives do; the law in Python is the derivative of its energy."""
    springs = (
        Spring("constant", ConstantForce(-2.0), joint="flexion"),
        Spring("table", TableLaw((-4.0, 0.0, 4.0), (-1.0, 0.0, 1.5)), joint="flexion"),
        Spring("linear", LinearSpring(3.0, 0.2), joint="flexion"),
    )
    exo = ep.load(URDF / "serial-y-x-z.urdf")
    robot = ep.ShoulderExo.from_device(exo.device.replace(springs=springs)).to_urdf(tmp_path)
    assert ep.load(robot).device.springs == springs
    beside = robot.with_suffix(".device.toml")
    text = beside.read_text()
    assert "effort_N_m = 2.0" in text
    loaded = ep.load(robot)
    R = loaded.pose(30, 20, 10)
    joint = loaded.chain.model.joints[loaded.chain.model.getJointId("flexion")]
    turn = float(loaded.configurations(R)[joint.idx_q])
    efforts = 2.0 - float(springs[1].law.force(turn)) - 3.0 * (turn - 0.2)
    drive = [each.name for each in exo.device.drives].index("flexion")
    own, other = (each.reaction(R, limits="none").actuator_forces[drive] for each in (loaded, exo))
    # The drive's effort and the springs' add to what the weight needs.
    np.testing.assert_allclose(own + efforts, other, atol=1e-9)
    for old, new in (("effort_N_m", "moment_N_m"), ("efforts_N_m", "moments_N_m"), ("effort_N_m", "force_N")):
        beside.write_text(text.replace(f"{old} =", f"{new} ="))
        with pytest.raises(ep.FileFormatError, match="opposite sign: positive efforts turn"):
            ep.load(robot)
