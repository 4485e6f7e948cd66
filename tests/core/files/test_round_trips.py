"""Files that the package writes: records with every optional key drawn at random come back equal."""

import numpy as np
import pytest
from drawn_records import COUNT, Drawn, design, left, muscle, owners
from measured_devices import poses as human_poses
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
from exo_pin.control import MeasuredRun, read_run, write_run
from exo_pin.muscle import (
    ConstantFriction,
    Damping,
    DynamicModel,
    LoadDependentFriction,
    load_dynamic,
    load_parameters,
    save_dynamic,
    save_parameters,
)


def test_designs_come_back(tmp_path):
    draw, path = Drawn(1), tmp_path / "drawn.toml"
    for _ in range(COUNT):
        mechanism = design(draw)
        ep.ShoulderExo.from_mechanism(mechanism).save(path)
        again = ep.load(path).mechanism
        assert same(again, mechanism)
        assert str(owners(again.arm)) == str(owners(mechanism.arm))
        assert again.arm is None or again.arm.body_mass == mechanism.arm.body_mass
        before = path.read_bytes()
        ep.ShoulderExo.from_mechanism(again).save(path)
        assert path.read_bytes() == before
    # Circles make their points, degrees are another unit of a field, and of a muscle no scaled law is written.
    assert left(draw) <= {"degrees", "circles", "nominal_length"}


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
