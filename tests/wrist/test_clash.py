"""Whether an answer says that limbs pass through the wearer."""

from dataclasses import replace

import numpy as np
import pytest

import exo_pin as ep
from exo_pin.wrist.clearance.clearance import limb_gaps, limb_radii

WEARER = ep.Wearer(1.75, 75, "male")


def cables():
    return ep.load("four-cables").worn_by(WEARER)


def test_a_limb_through_the_arm_is_counted_by_hand():
    exo = cables()
    # Joint 1 on the axis of the upper arm: its limb ends inside the arm, by the radii of arm and cable.
    platform = np.array(exo.geometry.platform_points)
    platform[0] = [0.0, 0.0, -0.15]
    inside = exo.replace(geometry=exo.geometry.replace(platform_points=platform))
    answer = inside.reaction(inside.pose(0, 0))
    deep = WEARER.dimensions()["upper arm girth"] / (2.0 * np.pi) + 0.003
    assert answer.clearance == pytest.approx(-deep)
    assert f"limb 1 passes through the wearer's arm ({1e3 * deep:.0f} mm deep)" in answer.verdict
    assert answer.as_dict()["clearance"] == answer.clearance


def test_limbs_that_keep_clear_are_not_named_and_the_gap_is_printed():
    exo = cables()
    poses = exo.pose([0, 60], [30, 30])
    answer = exo.reaction(poses)
    assert answer.verdict == "The device can hold 2 of 2 poses."
    assert not any("Not checked" in text for text in answer.cautions)
    least = exo.workspace(poses, ["clearance"]).margins["clearance"]
    np.testing.assert_allclose(answer.clearance, least, atol=1e-12)
    radii, body = limb_radii(exo.mechanism), ep.BodyShape.of(WEARER)
    each = limb_gaps(poses.as_matrix(), exo.mechanism, radii, body)
    assert each.shape == (4, 3)
    assert each.min() == pytest.approx(answer.clearance.min(), abs=1e-12)


def test_a_bent_elbow_and_another_side_count():
    bent = cables().worn_by(replace(WEARER, elbow_flexion=np.pi / 2))
    text = "limb 1 passes through the wearer's arm"
    assert text in bent.reaction(bent.pose(60, 30)).verdict
    assert text in bent.mirrored().reaction(bent.mirrored().pose(60, 30)).verdict
    stack = bent.reaction(bent.pose([30, 60], 30)).verdict
    assert "In 2 of 2 poses limbs pass through the wearer's arm, by up to 4" in stack


def test_nothing_is_said_of_a_wearer_who_is_not_known():
    exo = cables()
    unknown = exo.replace(arm=replace(exo.mechanism.arm, wearer=None))
    answer = unknown.reaction(exo.pose(60, 30))
    assert np.isnan(answer.clearance)
    (said,) = (text for text in answer.cautions if text.startswith("Not checked: whether the device touches the body"))
    assert said.endswith("Not known: who wears it (worn_by, --person).")


def test_a_limb_without_actuator_is_named_where_its_wearer_is_known():
    exo = cables()
    bare = exo.replace(limbs=[ep.Limb("SPS"), *exo.mechanism.limbs[1:]])
    assert bare.mechanism.arm.wearer is not None
    answer = bare.reaction(bare.pose(60, 30))
    assert np.isnan(answer.clearance)
    (said,) = (text for text in answer.cautions if text.startswith("Not checked: whether the device touches the body"))
    assert said.endswith("Not known: radius of limb 1 (family of the actuator, or limb_radius).")


def test_the_wearer_of_a_file_is_written_and_read(tmp_path):
    person = ep.Person(1.62, 58, "female", elbow_flexion=0.4, payload=0.5)
    for side in ("left", "right"):
        exo = ep.load("prototype", side=side).worn_by(person)
        exo.save(tmp_path / "worn.toml")
        again = ep.load(tmp_path / "worn.toml")
        own, read = exo.mechanism.arm, again.mechanism.arm
        assert (read.wearer.height, read.wearer.sex, read.wearer.elbow_flexion, read.wearer.payload) == (
            1.62, "female", 0.4, 0.5,
        )  # fmt: skip
        np.testing.assert_array_equal(read.inertia_about_origin, own.inertia_about_origin)
        np.testing.assert_array_equal(read.centre_of_mass, own.centre_of_mass)
        # An arm that was changed keeps its numbers, and its wearer's body.
        heavy = exo.replace(arm=ep.Arm(5.0, [0, 0, -0.3], wearer=own.wearer))
        heavy.save(tmp_path / "heavy.toml")
        assert ep.load(tmp_path / "heavy.toml").mechanism.arm.mass == 5.0
        assert ep.load(tmp_path / "heavy.toml").mechanism.arm.wearer.height == 1.62
    with pytest.raises(ep.InvalidInput, match="Wearer"):
        exo.worn_by("1.75,75,male")
    with pytest.raises(ep.InvalidInput, match="wearer"):
        ep.Arm(5.0, [0, 0, -0.3], wearer=1.75)


def test_a_torso_is_one_body_in_the_frontal_plane_that_the_shoulder_belongs_to():
    for side, outward in (("left", 1.0), ("right", -1.0)):
        torso = ep.BodyShape.of(WEARER, side).torso
        ends, radii = torso[:, :6].reshape(-1, 2, 3), torso[:, 6]
        assert (ends[..., 0] == 0.0).all()
        assert (outward * ends[..., 1] <= 0.0).all()
        assert (ends == 0.0).all(axis=2).sum() == 1  # the shoulder
        # Points along each capsule, near enough to each other.
        points = ends[:, :1] + np.linspace(0.0, 1.0, 40)[:, None] * (ends[:, 1:] - ends[:, :1])
        away = np.linalg.norm(points[:, None, :, None] - points[None, :, None], axis=-1).min(axis=(2, 3))
        touch = (away < radii[:, None] + radii).astype(float)
        assert (np.linalg.matrix_power(touch, len(torso)) > 0.0).all()
