"""Designs with other values, who wears them and what stands about them: each number by hand."""

import re
from dataclasses import replace

import numpy as np
import pytest
from mirror_image import MIRROR

import exo_pin as ep
from exo_pin.design import body_dimensions, obstacles
from exo_pin.design.actuator_families import stroke_of_length
from exo_pin.design.parameters.names import assigned, bounds_of, parameter, values_of

MAN = ep.Wearer(1.755, 85, "male")


def with_value(exo, name, value):
    (named,) = exo.device.parameters([name])
    return ep.ShoulderExo.from_device(exo.device.with_values({named: value}))


@pytest.mark.parametrize("name", ["four-cables", "prototype"])
def test_each_dimension_changes_alone(name):
    exo = ep.load(name)
    device = exo.device
    own = device.dimensions()
    assert ep.load(name, side="right").device.dimensions() == pytest.approx(own, abs=1e-12)
    for key, value in own.items():
        changed = device.with_dimensions(**{key: value + 0.01})
        assert changed.dimensions() == pytest.approx(own | {key: value + 0.01}, abs=1e-12), key
    geometry = exo.geometry
    if name == "four-cables":
        (x, y, z), at = geometry.base_points[2], geometry.platform_points[2]
        assert own["A[3].radius_m"] == pytest.approx(np.linalg.norm([x, y, z]))
        assert own["A[3].azimuth_rad"] == pytest.approx(np.arctan2(y, x))
        assert own["A[3].elevation_rad"] == pytest.approx(np.arcsin(z / own["A[3].radius_m"]))
        assert (own["B[3].radius_m"], own["B[3].drop_m"]) == pytest.approx((np.hypot(*at[:2]), -at[2]))
    for frames, points in (
        (geometry.base_frames, geometry.base_points),
        (geometry.platform_frames, geometry.platform_points),
    ):
        np.testing.assert_allclose(np.swapaxes(frames, -1, -2) @ frames, [np.eye(3)] * len(points), atol=1e-12)
        np.testing.assert_allclose(frames[..., 1], -points / np.linalg.norm(points, axis=1)[:, None], atol=1e-12)


def test_a_scaled_device_is_one_of_that_size():
    exo = ep.load("four-cables")
    tackle = ep.design.Tackle(2.0, 0.3, "best", 4e5)
    cable = ep.Actuator("cable", pull_limit=80.0, travel_limit=0.1, tackle=tackle)
    exo = exo.replace(limbs=[replace(exo.limbs[0], actuator=cable), *exo.limbs[1:]])
    larger = with_value(exo, "scale", 1.3)
    pose = exo.pose(40, 20)
    lengths = [each.inverse_kinematics(pose).lengths for each in (exo, larger)]
    np.testing.assert_allclose(lengths[1], 1.3 * lengths[0], rtol=1e-12)
    own = larger.limbs[0]
    assert own.length_range == pytest.approx(1.3 * np.array(exo.limbs[0].length_range))
    assert (own.actuator.travel_limit, own.actuator.tackle.muscle_length) == pytest.approx((0.13, 0.39))
    assert own.actuator.pull_limit == 80.0
    worn = ep.load("prototype")
    assert with_value(worn, "scale", 2.0).limbs[1].stroke == replace(
        worn.limbs[1].stroke, nominal_length=0.5, end_fitting=2.0 * worn.limbs[1].stroke.end_fitting
    )
    # A mean height is that of all joints on the arm.
    lower = with_value(exo, "cuff_height", 0.3).geometry
    assert lower.platform_points[:, 2].mean() == pytest.approx(-0.3)
    assert np.ptp(lower.platform_points - exo.geometry.platform_points, axis=0) == pytest.approx(0.0, abs=1e-12)


def test_limits_of_one_limb_and_of_all():
    exo = ep.load("four-linear-actuators-worn")
    limbs = with_value(exo, "pull_limit[2]", 77.0).limbs
    assert [limb.actuator.pull_limit == 77.0 for limb in limbs] == [False, True, False, False]
    limbs = with_value(exo, "push_limit", 55.0).limbs
    assert {limb.actuator.push_limit for limb in limbs} == {55.0}
    longer = with_value(exo, "nominal_length[3]", 0.5).limbs[2].stroke
    own = exo.limbs[2]
    assert longer == stroke_of_length("linear", 0.5, own.stroke.end_fitting, own.actuator.travel_limit)
    assert {limb.kind for limb in with_value(exo, "limb_kind", "UPU").limbs} == {"UPU"}
    with pytest.raises(ep.MissingData, match="stroke of limb 1"):
        exo.device.replace(limbs=[ep.Limb("SPS")] * 4).with_dimensions(**{"end_fitting[1]_m": 0.1})


def test_a_trunk_that_leans_and_a_hand_that_holds():
    exo = ep.load("four-cables").worn_by(MAN)
    sin, cos = 9.81 * np.sin(np.radians(30.0)), 9.81 * np.cos(np.radians(30.0))
    for name, gravity in (("lean_forward_deg", [sin, 0.0, -cos]), ("lean_left_deg", [0.0, sin, -cos])):
        (named,) = exo.device.parameters([name])
        np.testing.assert_allclose(exo.device.with_values({named: np.radians(30.0)}).gravity, gravity, atol=1e-12)
    (named,) = exo.device.parameters(["payload"])
    loaded = exo.device.with_values({named: 2.0}, (0.1, 0.0, -0.5)).arm
    assert loaded.mass == pytest.approx(exo.arm.mass + 2.0)
    moment = exo.arm.mass * exo.arm.centre_of_mass + 2.0 * np.array([0.1, 0.0, -0.5])
    np.testing.assert_allclose(loaded.mass * loaded.centre_of_mass, moment, atol=1e-12)
    with pytest.raises(ep.InvalidInput, match="payload_at"):
        exo.device.with_values({named: 2.0})


def test_names_and_texts_of_values():
    length, angle, limb = parameter("r_A_mm"), parameter("A[2].azimuth_deg"), parameter("pull_limit")
    assert (length.key, length.limb, length.unit, length.size, length.si_name) == ("r_A", None, "mm", 1e-3, "r_A")
    assert (angle.key, angle.limb, angle.si_name) == ("A.azimuth", 2, "A[2].azimuth")
    assert angle.in_si([180.0, 90.0]) == pytest.approx([np.pi, np.pi / 2])
    assert (limb.full_name, length.full_name, limb.in_si("much")) == ("pull_limit_N", "r_A_mm", "much")
    assert values_of(length, "100:160:4") == [100.0, 120.0, 140.0, 160.0]
    assert values_of(length, "100,160") == values_of(length, (100.0, 160.0)) == [100.0, 160.0]
    assert values_of(parameter("limb_kind"), "UPU,SPS") == ["UPU", "SPS"]
    assert bounds_of(length, "100:160") == bounds_of(length, (100, 160)) == pytest.approx((0.1, 0.16))
    assert assigned(["r_A_mm=1:2:3", "h_B=0.2"]) == {"r_A_mm": "1:2:3", "h_B": "0.2"}
    full_turn = parameter("alpha[1]")
    assert values_of(full_turn, [6.28, -6.28]) == [6.28, -6.28]
    for ask, message in (
        (lambda: values_of(full_turn, [6.3]), "degrees?"),
        (lambda: bounds_of(full_turn, (-6.3, 0.0)), "degrees?"),
        (lambda: values_of(length, "1:2:2.5"), "whole count"),
        (lambda: values_of(length, "1:2:0"), "whole count"),
        (lambda: values_of(length, []), "a sequence"),
        (lambda: values_of(parameter("limbs"), "a"), "objects in Python"),
        (lambda: bounds_of(length, "1:2:3"), "LOW:HIGH"),
        (lambda: bounds_of(length, (2.0, 1.0)), "(lowest, highest)"),
        (lambda: assigned(["r_A"]), "NAME=VALUES"),
        (lambda: assigned(["r_A=1", "r_A=2"]), "twice"),
        (lambda: parameter("r_A_deg"), "in m or mm"),
        (lambda: parameter("r_A[1]"), "without a limb"),
        (lambda: ep.load("prototype").device.with_dimensions(**{"r_A_m": 0.1, "A[1].radius_m": 0.2}), "both"),
        (lambda: ep.load("four-cables").device.parameters(["A[5].radius"]), "limb from 1 to 4"),
        (lambda: ep.load("four-cables").device.with_dimensions(r_A_m=0.1), "vary A[i] and B[i]"),
    ):
        with pytest.raises(ep.InvalidInput, match=re.escape(message)):
            ask()


def faces(rows):
    """Least and greatest coordinates of capsules, shape (K, 3) each."""
    ends, radius = rows[:, :6].reshape(-1, 2, 3), rows[:, 6:]
    return ends.min(axis=1) - radius, ends.max(axis=1) + radius


def test_what_stands_about_a_person():
    sizes = MAN.dimensions()
    seat, middle = 0.182 * MAN.height - sizes["sitting height"], -0.129 * MAN.height
    back = 0.5 * max(sizes["chest depth"], sizes["waist depth"])
    made = {
        name: obstacles.obstacle(name, MAN) for name in ("chair", "wheelchair", "car", "wall:100", "ceiling", "door")
    }
    worn = obstacles.obstacle("wall:100", replace(MAN, clothing=0.01))
    for rows, away in ((made["wall:100"], back + 0.1), (worn, back + 0.11), (obstacles.obstacle("bed", MAN), back)):
        assert faces(rows)[1][0, 0] == pytest.approx(-away)
    assert faces(made["ceiling"])[0][0, 2] == pytest.approx(0.182 * MAN.height)
    for away in (0.0, 0.1):
        low, high = faces(obstacles.obstacle(f"door:{1e3 * away:g}", MAN))
        # The person stands in the middle of the passage.
        assert (low[0, 1], high[1, 1]) == pytest.approx((middle + 0.4075 + away, middle - 0.4075 - away))
    for name, width, top, rests in (("chair", 0.455, 0.42, 0.23), ("wheelchair", 0.66, 0.43, 0.275)):
        rows = made[name]
        low, high = faces(rows)
        upright = rows[:, 2] != rows[:, 5]
        assert high[upright, 0] == pytest.approx(-back)
        assert (low[upright, 1].min(), high[upright, 1].max()) == pytest.approx(
            (middle - width / 2, middle + width / 2)
        )
        assert high[upright, 2].max() == pytest.approx(seat + top)
        assert rows[upright, 2] == pytest.approx(seat)
        gaps = np.diff(np.sort(rows[upright, 1]))
        assert gaps.max() <= 2.0 * 0.015 + 1e-9  # no gap between the slats
        arms = rows[~upright & (rows[:, 6] == 0.025)]
        assert arms[:, 2] + 0.025 == pytest.approx([seat + rests] * 2)
        assert arms[:, 3] - arms[:, 0] == pytest.approx([0.27] * 2)
        assert np.abs(arms[:, 1] - middle) == pytest.approx([width / 2 - 0.025] * 2)
    handles = made["wheelchair"][-2:]
    assert handles[:, 0] - handles[:, 3] == pytest.approx([0.1, 0.1])
    assert handles[:, 2] + 0.015 == pytest.approx([seat + 0.43] * 2)
    low, high = faces(made["car"])
    head = sizes["head girth"] / (2.0 * np.pi)
    restraint = high[:, 2] > 0.01
    assert high[restraint, 2] == pytest.approx(0.83 - 0.288 * MAN.height)
    assert high[restraint, 0] == pytest.approx(-head - 0.055)
    assert np.ptp([low[restraint, 1].min(), high[restraint, 1].max()]) == pytest.approx(2.0 * head)
    for name in ("wall:x", "wall:-1", "wall:10000"):
        with pytest.raises(ep.InvalidInput, match="distance in mm"):
            obstacles.obstacle(name, MAN)


def test_women_and_men_of_a_size_have_bodies_of_a_size():
    """Within what two regressions differ at sizes that both sexes have; a woman's neck is the thinnest by a man's."""
    for height, mass in ((1.60, 60.0), (1.70, 70.0), (1.80, 90.0)):
        woman, man = (body_dimensions.body_dimensions(height, mass, sex) for sex in ("female", "male"))
        shares = {name: woman[name] / man[name] for name in man}
        assert min(shares, key=shares.get) == "neck girth"
        assert all(0.87 < share < 1.08 for share in shares.values())
        assert woman["sitting height"] / height == pytest.approx(0.52, abs=0.01)
    thick = replace(MAN, arm_girth=1.1 * MAN.dimensions()["upper arm girth"]).dimensions()
    for name, value in MAN.dimensions().items():
        assert thick[name] == pytest.approx(value * (1.1 if name.endswith("arm girth") else 1.0))


def test_segments_of_women_and_men_are_bodies_alike():
    """Shares of the mass and of the length, and radii of gyration over the length, differ by less than a third."""
    sizes = {}
    for sex in ("female", "male"):
        bodies = ep.Wearer(1.70, 70.0, sex).segments()
        down = np.array([-centre[2] for _, centre, _ in bodies])
        gyration = [np.sqrt(np.diag(inertia) / mass) for mass, _, inertia in bodies]
        sizes[sex] = np.column_stack([[mass for mass, *_ in bodies], down, gyration])
    share = sizes["female"] / sizes["male"]
    assert (share > 0.74).all()
    assert (share < 1.04).all()
    # Longest across, thinnest about the length.
    for each in sizes.values():
        assert (each[:, 2] > each[:, 3]).all()
        assert (each[:, 3] > each[:, 4]).all()


def test_a_spring_of_an_interface_and_its_mirror_image():
    rng = np.random.default_rng(4)
    root = rng.normal(size=(6, 6))
    spring = ep.Interface(root @ root.T + 6.0 * np.eye(6), at=[0.1, 0.05, -0.2])
    image, flip = spring.mirrored(), np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    step = rng.normal(size=6)
    assert (step * flip) @ image.stiffness @ (step * flip) == pytest.approx(step @ spring.stiffness @ step)
    assert image.at.tolist() == (spring.at @ MIRROR).tolist()
    np.testing.assert_allclose(spring.compliance @ spring.stiffness, np.eye(6), atol=1e-12)
    # The wrench about the spring's own point, in the arm's axes, is what its slip makes.
    turn = ep.shoulder_rotation(40, 30, 20, degrees=True).as_matrix()
    force, moment = turn.T @ np.array([3.0, -2.0, 5.0]), turn.T @ np.array([0.4, 0.1, -0.3])
    wrench = np.concatenate([force, moment - np.cross(spring.at, force)])
    slip = spring.slip(np.array([3.0, -2.0, 5.0, 0.4, 0.1, -0.3]), turn)
    np.testing.assert_allclose(spring.stiffness @ slip, wrench, rtol=1e-9)
    assert np.diag(ep.Interface.of([2e3, 3e3, 4e3], 5.0).stiffness).tolist() == [2e3, 3e3, 4e3, 5.0, 5.0, 5.0]
    once, twice = (ep.Interface.upper_arm_cuff(0.15, times) for times in (1.0, 2.0))
    np.testing.assert_allclose(twice.stiffness, 2.0 * once.stiffness)
    assert np.diag(once.stiffness)[3:] == pytest.approx(np.degrees([0.185, 0.21, 0.035]))
    soft = ep.Interfaces(harness=spring, cuff_area=0.01).mirrored()
    assert (soft.harness.at.tolist(), soft.cuff, soft.cuff_area) == (image.at.tolist(), None, 0.01)
    assert [each.are_rigid for each in (soft, ep.Interfaces(cuff=spring), ep.Interfaces())] == [False, False, True]


def test_a_limb_has_the_limits_of_its_actuator():
    data = {"speed_limit": 0.2, "power_limit": 30.0, "play": 1e-4, "resolution": 1e-5}
    limb = ep.Limb("SPS", actuator=ep.Actuator("linear", pull_limit=90.0, push_limit=70.0, **data))
    assert {name: getattr(limb, name) for name in data} == data
    assert limb.effort_range == (-70.0, 90.0)
    assert {getattr(ep.Limb(), name) for name in data} == {None}
    assert limb.missing_limits(False) == ["stroke"]
    assert ep.Limb(stroke=ep.Stroke(0.3, 0.7, 1.0)).missing_limits(False) == ["end fitting", "actuator"]
    assert ep.Limb(stroke=ep.Stroke(0.3, 0.7, 1.0, 0.0)).missing_limits(True) == []
    tube = ep.LimbGuide(60.0, 40.0, joint_stiffness=3e4).times(1.5)
    assert (tube.bending_rigidity, tube.torsional_rigidity, tube.joint_stiffness) == (90.0, 60.0, 3e4)
    assert np.isnan([*ep.Limb().effort_range, *ep.Limb().length_range]).all()
    cable = ep.Actuator("cable", pull_limit=90.0, least_tension=5.0)
    assert ep.Limb("SPS", actuator=cable).effort_range == (5.0, 90.0)
    muscle = ep.Actuator("pneumatic muscle", force_law="best", supply_pressure=4e5)
    assert muscle.effort_range[0] == 0.0
    assert np.isnan(muscle.effort_range[1])
    for supply, message in ((99.0, "bar?"), (1.01e7, "pascals under bar?")):
        with pytest.raises(ep.InvalidInput, match=re.escape(message)):
            replace(muscle, supply_pressure=supply)
    assert replace(muscle, supply_pressure=9.9e6).supply_pressure == 9.9e6
