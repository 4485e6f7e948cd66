"""Derivatives against finite differences of the whole query, and those by bounds against re-solved programs."""

from dataclasses import replace

import numpy as np
import pytest
from guided_limbs import SOFT_JOINTS, STIFFNESS, guided
from scipy.spatial.transform import Rotation
from wrists import random_mechanism, regular_poses

import exo_pin as ep

DEGREES = {"degrees": True}
OFFSET = ep.CentreOffset([0.004, -0.003, 0.005], [-0.002, 0.004, 0.003])
MOTION = ep.Motion([0.5, -1.0, 0.8], [2.0, 1.0, -3.0])
LOAD = ep.Load([5.0, -3.0, -20.0], [0.4, 0.2, -0.3], [0.02, 0.01, -0.5], "base")
ARM_LOAD = replace(LOAD, frame="arm")


@pytest.fixture(scope="module")
def worn():
    return guided(ep.load("prototype").worn_by(ep.Arm.from_anthropometry(1.75, 75, "male")), SOFT_JOINTS)


def variation(exo, name, index, step):
    """Design, load, offset and turn with one component of one parameter moved."""
    geometry, arm, limbs = exo.geometry, exo.arm, list(exo.limbs)
    load, offset, turn = LOAD, OFFSET, Rotation.identity()
    e = np.zeros(3)
    e[index % 3] = step
    six = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))
    shoulder = exo.mechanism.shoulder
    if name == "orientation":
        turn = Rotation.from_rotvec(e)
    elif name in ("base_points", "platform_points"):
        points = np.array(getattr(geometry, name))
        points[index // 3, index % 3] += step
        geometry = geometry.replace(**{name: points})
    elif name in ("r_A", "r_B", "h_A", "h_B"):
        geometry = geometry.replace(**{name: getattr(geometry.circles, name) + step})
    elif name in ("alpha_A", "alpha_B"):
        angles = {key: np.array(getattr(geometry.circles, key)) for key in ("alpha_A", "alpha_B")}
        angles[name][index] += step
        geometry = geometry.replace(**angles)
    elif name == "mass":
        arm = ep.Arm(arm.mass + step, arm.centre_of_mass, arm.inertia)
    elif name == "centre_of_mass":
        arm = ep.Arm(arm.mass, arm.centre_of_mass + e, arm.inertia)
    elif name == "inertia":
        i, j = six[index]
        inertia = np.array(arm.inertia)
        inertia[i, j] += step
        inertia[j, i] = inertia[i, j]
        arm = ep.Arm(arm.mass, arm.centre_of_mass, inertia)
    elif name.startswith("load_"):
        key = {"load_force": "force", "load_moment": "moment", "load_point": "at"}[name]
        load = replace(LOAD, **{key: getattr(LOAD, key) + e})
    elif name.startswith("offset"):
        which = {"offset": ("base", "cuff"), "offset_base": ("base",), "offset_cuff": ("cuff",)}[name]
        offset = replace(OFFSET, **{side: getattr(OFFSET, side) + e for side in which})
    elif name == "shoulder_stiffness":
        i, j = six[index]
        K = np.array(shoulder.stiffness)
        K[i, j] += step
        K[j, i] = K[i, j]
        shoulder = ep.Shoulder(stiffness=K)
    else:
        limbs[index] = replace(
            limbs[index], guide=replace(limbs[index].guide, **{name: getattr(limbs[index].guide, name) + step})
        )
    made = exo.replace(geometry=geometry, arm=arm, limbs=tuple(limbs), shoulder=shoulder)
    return made, load, offset, turn


STEPS = {
    "N m²": 1e-3,
    "N/m": 1.0,
    "N m/rad": 0.1,
    "kg": 1e-3,
    "kg m²": 1e-4,
    "N": 1e-2,
    "N m": 1e-3,
    "m": 1e-6,
    "rad": 1e-6,
}


@pytest.mark.parametrize(
    ("kind", "split"),
    [
        ("random-4", "spherical"), pytest.param("prototype", "spherical", marks=pytest.mark.full),
        pytest.param("prototype", "elastic_linear", marks=pytest.mark.full),
        pytest.param("random-4", "elastic_linear", marks=pytest.mark.full),
    ],
)  # fmt: skip
def test_every_parameter_against_finite_differences(kind, split, worn):
    exo = worn
    if kind != "prototype":
        mechanism = random_mechanism(np.random.default_rng(70), 4, ["UPU", "SPS", "UPU", "UPU"])
        exo = guided(ep.ShoulderExo.from_mechanism(mechanism), SOFT_JOINTS)
    pose = regular_poses(exo.mechanism, np.random.default_rng(71), 1, margin=0.1)[0]
    found = exo.sensitivity(pose, MOTION, LOAD, split, OFFSET)
    answer = exo.reaction(pose, MOTION, LOAD, split=split, centre_offset=OFFSET)
    np.testing.assert_allclose(found.shoulder_force, answer.shoulder_force, rtol=1e-9)
    np.testing.assert_allclose(found.actuator_forces, answer.actuator_forces, rtol=1e-9)
    np.testing.assert_allclose(found.constraint_forces, answer.constraint_forces, rtol=1e-8, atol=1e-10)
    expected = {"orientation", "base_points", "platform_points", "mass", "centre_of_mass", "inertia", "load_force",
                "load_moment", "load_point", "offset", "offset_base", "offset_cuff", "bending_rigidity",
                "torsional_rigidity", "joint_stiffness", "joint_twist_stiffness"}  # fmt: skip
    expected |= {"shoulder_stiffness"} if split == "elastic_linear" else set()
    expected |= {"r_A", "r_B", "h_A", "h_B", "alpha_A", "alpha_B"} if kind == "prototype" else set()
    assert set(found.parameters) == expected
    for name, parameter in found.parameters.items():
        step = STEPS[parameter.unit]
        for p, label in enumerate(parameter.labels):
            index = int(label) - 1 if label.isdigit() else p
            differences = []
            for h in (step, -step, 2 * step, -2 * step):
                made, load, offset, turn = variation(exo, name, index, h)
                moved = made.reaction(turn * pose, MOTION, load, split=split, centre_offset=offset)
                differences.append(
                    np.concatenate([moved.shoulder_force, moved.actuator_forces, moved.constraint_forces])
                )
            a, b, c, d = differences
            slope = (8.0 * (a - b) - (c - d)) / (12.0 * step)
            exact = np.concatenate(
                [parameter.shoulder_force[:, p], parameter.actuator_forces[:, p], parameter.constraint_forces[:, p]]
            )
            # Rounding of the forces, about 1e-13 of them, over the step.
            rounding = 1e-12 * np.abs(a).max() / step
            np.testing.assert_allclose(exact, slope, rtol=1e-6, atol=rounding, err_msg=f"{name} {label}")


def test_orientation_with_a_load_that_turns_with_the_arm(worn):
    pose = ep.shoulder_rotation(60, 30, 0, **DEGREES)
    found = worn.sensitivity(pose, None, ARM_LOAD, "elastic_linear", OFFSET)["orientation"].shoulder_force
    for axis, e in enumerate(np.eye(3)):
        ends = [
            worn.reaction(
                Rotation.from_rotvec(h * e) * pose, load=ARM_LOAD, split="elastic_linear", centre_offset=OFFSET
            ).shoulder_force
            for h in (1e-5, -1e-5)
        ]
        np.testing.assert_allclose(found[:, axis], (ends[0] - ends[1]) / 2e-5, rtol=1e-5, atol=1e-4)


def test_magnitude_stack_and_bad_row(worn):
    good = ep.shoulder_rotation(60, 30, 0, **DEGREES)
    poses = Rotation.concatenate([ep.shoulder_rotation(0, 90, 0, **DEGREES), good])
    stack, single = worn.sensitivity(poses), worn.sensitivity(good)
    assert stack.status.tolist() == ["singular", "ok"]
    assert np.isnan(stack["r_A"].shoulder_force[0]).all()
    for name in single.parameters:
        np.testing.assert_allclose(stack[name].shoulder_force[1], single[name].shoulder_force, rtol=1e-9, atol=1e-9)
    thicker = worn.replace(geometry=worn.geometry.replace(r_A=worn.geometry.circles.r_A + 1e-6))
    slope = (thicker.reaction(good).magnitude - worn.reaction(good).magnitude) / 1e-6
    np.testing.assert_allclose(single.magnitude("r_A"), slope, rtol=1e-3)
    with pytest.raises(ep.UnknownName, match="r_A"):
        single["radius"]


def test_stiffness_does_not_matter_to_bare_muscles(worn):
    bare = worn.replace(limbs=(ep.Limb(),) * 3)
    found = bare.sensitivity(ep.shoulder_rotation(60, 30, 0, **DEGREES), split="elastic_linear")
    assert "bending_rigidity" not in found.parameters
    np.testing.assert_allclose(found["shoulder_stiffness"].shoulder_force, 0.0, atol=1e-12)
    assert np.array_equal(STIFFNESS, STIFFNESS.T)


def test_ranking_of_a_movement(worn):
    movement = ep.shoulder_rotation(np.linspace(50, 80, 7), 30, 0, **DEGREES)
    ranking = worn.ranking(movement, split="elastic_linear")
    sizes = worn.reaction(movement, split="elastic_linear").magnitude
    assert ranking.peak == pytest.approx(sizes.max())
    assert ranking.at == (int(sizes.argmax()),)
    assert len(ranking.influences) == 5
    effects = [item.effect for item in ranking.influences]
    assert effects == sorted(effects, reverse=True)
    assert ranking.influences[0].name in str(ranking)
    # One that can be checked by moving the parameter: 1 % of the weight.
    only = dict.fromkeys(worn.sensitivity(movement[0], split="elastic_linear").parameters, 0.0)
    mass = worn.ranking(movement, split="elastic_linear", uncertainties={**only, "mass": "1%"})
    assert [item.name for item in mass.influences] == ["mass"]
    assert mass.influences[0].relative == pytest.approx(0.01)
    radius = worn.ranking(movement, split="elastic_linear", uncertainties={**only, "r_A": 1e-4}).influences[0]
    wider = worn.replace(geometry=worn.geometry.replace(r_A=worn.geometry.circles.r_A + 1e-4))
    moved = wider.reaction(movement[ranking.at[0]], split="elastic_linear").magnitude
    assert radius.effect == pytest.approx(abs(float(moved) - ranking.peak), rel=1e-2)
    # A ball: no offset of that size does more, to first order.
    offset = worn.ranking(movement, split="elastic_linear", uncertainties={**only, "offset": 1e-5}).influences[0]
    rng = np.random.default_rng(73)
    for direction in rng.normal(size=(20, 3)):
        shift = 1e-5 * direction / np.linalg.norm(direction)
        moved = worn.reaction(movement[ranking.at[0]], split="elastic_linear", centre_offset=shift).magnitude
        assert abs(float(moved) - ranking.peak) <= offset.effect * 1.01
    stiff = worn.ranking(
        movement, split="elastic_linear", uncertainties={**only, "shoulder_stiffness": "1%"}
    ).influences[0]
    K = 1.01 * np.array(worn.mechanism.shoulder.stiffness)
    moved = (
        worn.replace(shoulder=ep.Shoulder(stiffness=K))
        .reaction(movement[ranking.at[0]], split="elastic_linear")
        .magnitude
    )
    assert stiff.effect == pytest.approx(abs(float(moved) - ranking.peak), rel=2e-2)


def test_no_poses_have_no_derivatives(worn):
    nowhere = worn.sensitivity(ep.shoulder_rotation(np.empty((0, 2)), 0, 0, **DEGREES))
    assert nowhere["base_points"].value.shape == (0, 2, 9)
    assert nowhere["mass"].shoulder_force.shape == (0, 2, 3, 1)


def test_bad_rankings(worn):
    pose = ep.shoulder_rotation(60, 30, 0, **DEGREES)
    with pytest.raises(ep.UnknownName, match="radius"):
        worn.ranking(pose, uncertainties={"radius": 1.0})
    with pytest.raises(ep.InvalidInput, match="share"):
        worn.ranking(pose, uncertainties={"mass": "five"})
    with pytest.raises(ep.InvalidInput, match="orientation in rad"):
        worn.ranking(pose, uncertainties={"orientation": "5%"})
    with pytest.raises(ep.InvalidInput, match="mass"):
        worn.ranking(pose, uncertainties={"mass": -1.0})
    for uncertainties in ("mass", 3):
        with pytest.raises(ep.InvalidInput, match="uncertainties"):
            worn.ranking(pose, uncertainties=uncertainties)
    with pytest.raises(ep.InvalidInput, match="top"):
        worn.ranking(pose, top=0)
    with pytest.raises(ep.SolverFailed, match="no pose"):
        worn.ranking(ep.shoulder_rotation(0, 90, 0, **DEGREES))
    with pytest.raises(ep.InvalidInput, match="minimal"):
        worn.sensitivity(pose, split="minimal")
