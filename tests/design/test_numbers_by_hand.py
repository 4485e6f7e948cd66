"""Arms, persons, what stands about them, springs and loads of designs: published tables, and numbers by hand."""

from dataclasses import replace

import numpy as np
import pytest
from mirror_image import MIRROR

import exo_pin as ep
from exo_pin import InvalidInput, MissingData
from exo_pin.design import Arm, preset

MAN = ep.Wearer(1.755, 85, "male")


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


def faces(rows):
    """Least and greatest coordinates of capsules, shape (K, 3) each."""
    ends, radius = rows[:, :6].reshape(-1, 2, 3), rows[:, 6:]
    return ends.min(axis=1) - radius, ends.max(axis=1) + radius


def obstacle(name, wearer=MAN):
    """Capsules of what stands about a person."""
    return ep.BodyShape.of(wearer, obstacles=(name,)).torso[7:]


def test_what_stands_about_a_person():
    sizes = MAN.dimensions()
    seat, middle = 0.182 * MAN.height - sizes["sitting height"], -0.129 * MAN.height
    back = 0.5 * max(sizes["chest depth"], sizes["waist depth"])
    made = {name: obstacle(name) for name in ("chair", "wheelchair", "car", "wall:100", "ceiling", "door")}
    worn = obstacle("wall:100", replace(MAN, clothing=0.01))
    for rows, away in ((made["wall:100"], back + 0.1), (worn, back + 0.11), (obstacle("bed"), back)):
        assert faces(rows)[1][0, 0] == pytest.approx(-away)
    assert faces(made["ceiling"])[0][0, 2] == pytest.approx(0.182 * MAN.height)
    for away in (0.0, 0.1):
        low, high = faces(obstacle(f"door:{1e3 * away:g}"))
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


def test_inertia_of_table_5_4():
    arm = preset("prototype").arm
    np.testing.assert_allclose(np.linalg.eigvalsh(arm.inertia), [0.00107, 0.00390, 0.00402], atol=6e-6)
    printed = [
        [27867611.9, -21184.2, 319504.5],
        [-21184.2, 27638169.9, -2649709.2],
        [319504.5, -2649709.3, 1419768.2],
    ]
    # Read as a tensor, no body can have it.
    with pytest.raises(InvalidInput, match="negative"):
        Arm.from_inertia_about_origin(0.65656, [-0.0026, 0.0227, -0.1897], np.array(printed) * 1e-9)


def test_arms_add_as_bodies_do():
    rng = np.random.default_rng(1)
    points, masses = rng.normal(size=(40, 3)) * 0.1, rng.random(40)

    def body(selection, device=False):
        m, p = masses[selection], points[selection]
        about_origin = sum(w * (x @ x * np.eye(3) - np.outer(x, x)) for w, x in zip(m, p, strict=True))
        return Arm.from_inertia_about_origin(m.sum(), m @ p / m.sum(), about_origin, device=device)

    total = body(slice(0, 15)) + body(slice(15, 40), device=True)
    whole = body(slice(0, 40))
    assert total.mass == pytest.approx(whole.mass)
    np.testing.assert_allclose(total.centre_of_mass, whole.centre_of_mass, atol=1e-15)
    np.testing.assert_allclose(total.inertia, whole.inertia, atol=1e-15)
    assert total.person.mass == pytest.approx(masses[:15].sum())
    assert not total.device
    assert (total + Arm(1.0, [0, 0, 0])).inertia is None
    with pytest.raises(MissingData):
        _ = Arm(1.0, [0, 0, 0]).inertia_about_origin


def test_arm_of_a_person():
    arm = Arm.from_anthropometry(1.741, 73.0, "male")
    # The table's own person: 4.94 % of body mass; lengths 281.7, 268.9 and 86.2 mm.
    assert arm.mass == pytest.approx(0.0494 * 73.0)
    assert arm.body_mass == 73.0
    by_hand = (
        -(0.0271 * 0.5772 * 0.2817 + 0.0162 * (0.2817 + 0.4574 * 0.2689) + 0.0061 * (0.2817 + 0.2689 + 0.79 * 0.0862))
        / 0.0494
    )
    np.testing.assert_allclose(arm.centre_of_mass, [0, 0, by_hand], atol=1e-12)
    bent = Arm.from_anthropometry(1.741, 73.0, "male", elbow_flexion=90, degrees=True)
    assert bent.centre_of_mass[0] > 0.05
    assert bent.centre_of_mass[2] > arm.centre_of_mass[2]
    loaded = Arm.from_anthropometry(1.741, 73.0, "male", payload=1.0)
    moved = loaded.mass * loaded.centre_of_mass[2] - arm.mass * arm.centre_of_mass[2]
    assert moved == pytest.approx(-(0.2817 + 0.2689 + 0.0862))


def test_persons_drawn_have_the_percentiles_of_their_source():
    persons = ep.Wearer.drawn(4000, seed=3)
    for sex, height, mass in (("female", (1.525, 1.740), (51.0, 87.0)), ("male", (1.648, 1.870), (64.0, 111.0))):
        some = [each for each in persons if each.sex == sex]
        assert len(some) == 2000
        np.testing.assert_allclose(np.percentile([each.height for each in some], [5, 95]), height, atol=0.01)
        np.testing.assert_allclose(np.percentile([each.mass for each in some], [5, 95]), mass, rtol=0.04)
    assert [each.height for each in ep.Wearer.drawn(3, seed=3)] == [each.height for each in persons[:3]]
