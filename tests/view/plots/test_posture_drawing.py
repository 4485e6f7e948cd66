"""Drawings of devices on their wearer: joints, limbs and body where they are, seen from where it is said."""

import matplotlib

matplotlib.use("agg")

import numpy as np
import pytest
from places import URDF

import exo_pin as ep
from exo_pin.view.plots import design_drawing, posture_drawing

MAN = ep.Wearer(1.75, 75, "male", elbow_flexion=0.8)


def seen(points, side="left"):
    """Points of the base frame, m, on the picture, mm, and how near they are: from in front, outside and above."""
    away = np.array([1.0, 0.75 if side == "left" else -0.75, 0.35])
    away /= np.linalg.norm(away)
    right = np.array([-away[1], away[0], 0.0]) / np.hypot(*away[:2])
    up = np.array([0.0, 0.0, 1.0]) - away[2] * away
    return 1e3 * np.asarray(points) @ np.stack([right, up / np.linalg.norm(up), away], axis=1)


def segments(ax):
    return [line.get_xydata() for line in ax.get_lines()]


def has(ax, points, atol=1e-6):
    """Whether a line of these points is drawn, from either end."""
    points = np.asarray(points)[:, :2]
    return any(
        own.shape == points.shape and (np.allclose(own, points, atol=atol) or np.allclose(own, points[::-1], atol=atol))
        for own in segments(ax)
    )


def capsule(row, turn, side):
    """Ends as seen, and the radius in mm, of a capsule of the wearer."""
    return seen(turn @ row[:3], side), seen(turn @ row[3:6], side), 1e3 * row[6]


def is_outline(patch, ends):
    """Whether a patch is the outline of a capsule: all its points are a radius away from the line of the two ends."""
    (p, q), radius = (np.array(end[:2]) for end in ends[:2]), ends[2]
    corners, line = patch.get_xy()[:-1], q - p
    share = np.clip((corners - p) @ line / max(line @ line, 1e-12), 0.0, 1.0)
    far = np.linalg.norm(corners - p - share[:, None] * line, axis=1)
    wide = corners.max(axis=0) - corners.min(axis=0)
    whole = np.abs(p - q) + 2.0 * radius
    return np.abs(far - radius).max() < 1e-3 * radius and (np.abs(wide - whole) < 0.02 * radius).all()


@pytest.mark.parametrize("side", ["left", "right"])
def test_limbs_and_body_are_seen_from_in_front_and_outside(side):
    exo = ep.load("four-linear-actuators-worn", side=side).worn_by(MAN)
    poses = exo.pose([0.0, 60.0], [10.0, 40.0])
    figure = posture_drawing(exo, poses, ["first", "second"])
    body = ep.BodyShape.of(MAN, side)
    for ax, pose, title in zip(figure.axes, poses, ("first", "second"), strict=True):
        R = pose.as_matrix()
        assert ax.get_title() == title
        for a, b in zip(exo.geometry.base_points, exo.geometry.platform_points @ R.T, strict=True):
            assert has(ax, seen([a, b], side))
        wanted = [capsule(row, turn, side) for rows, turn in ((body.torso, np.eye(3)), (body.arm, R)) for row in rows]
        assert len(ax.patches) == len(wanted)
        for patch, ends in zip(ax.patches, wanted, strict=True):
            assert is_outline(patch, ends)
        # What is nearer covers what is farther away.
        depth = [0.5 * (ends[0][2] + ends[1][2]) for ends in wanted]
        order = [patch.get_zorder() for patch in ax.patches]
        assert (np.argsort(depth, kind="stable") == np.argsort(order, kind="stable")).all()
        numbers = [text for text in ax.texts if text.get_text().isdigit()]
        assert [text.get_text() for text in numbers] == ["1", "2", "3", "4"]
        places = np.array([text.get_position() for text in numbers])
        apart = np.linalg.norm(places[:, None] - places, axis=-1) + 1e9 * np.eye(4)
        assert apart.min() >= 60.0 - 1e-9
        # Where nothing is in the way a number stands on its limb, nearer to the torso.
        at = seen(0.75 * exo.geometry.base_points + 0.25 * exo.geometry.platform_points @ R.T, side)[:, :2]
        moved = places - at
        np.testing.assert_allclose(moved[:, 0], 0.0, atol=1e-9)
        assert (np.abs(moved[:, 1] / 30.0 - np.round(moved[:, 1] / 30.0)) < 1e-9).all()
        assert np.abs(moved[0]).max() < 1e-9
        # All of it is on the picture, 20 mm from its rim, in one scale for all postures.
        low, high = np.array([ax.get_xlim(), ax.get_ylim()]).T
        assert (low, high)[0].tolist() == np.array([figure.axes[0].get_xlim(), figure.axes[0].get_ylim()])[
            :, 0
        ].tolist()
    reach = [segment for ax in figure.axes for segment in segments(ax)[: None if ax is not figure.axes[-1] else -1]]
    for pose in poses:
        for rows, turn in ((body.torso, np.eye(3)), (body.arm, pose.as_matrix())):
            for p, q, radius in (capsule(row, turn, side) for row in rows):
                reach.append(np.array([end[:2] + sign * radius for end in (p, q) for sign in (-1.0, 1.0)]))
    every = np.concatenate(reach)
    np.testing.assert_allclose(low, every.min(axis=0) - 20.0)
    np.testing.assert_allclose(high, every.max(axis=0) + 20.0)


def test_links_routes_and_motors_of_another_device():
    exo = ep.load(URDF / "serial-y-x-z.urdf").worn_by(MAN)
    pose = exo.pose([40.0, 170.0], [20.0, 80.0])
    reached = np.isfinite(exo.configurations(pose)).all(axis=1)
    figure = posture_drawing(exo, pose, ["one", "two"])
    q = exo.configurations(pose[0])
    places = exo.chain.placements(q)
    # Hinges are where links meet.
    for first, second in (("internal_rotation", "abduction"), ("abduction", "flexion")):
        ends = seen([places[first].translation, places[second].translation])
        assert has(figure.axes[0], ends) or np.ptp(ends[:, :2], axis=0).max() <= 4.0
    assert [text.get_text() for text in figure.axes[0].texts if text.get_text().isdigit()] == ["1", "2", "3"]
    for ax, there in zip(figure.axes, reached, strict=True):
        assert any("not reached" in text.get_text() for text in ax.texts) != there
    # A spring and a cable run along their routes.
    support = ep.load(URDF / "spring-support.urdf").worn_by(MAN)
    (spring,) = support.device.springs
    pose = support.pose([50.0])
    (ax,) = posture_drawing(support, pose, ["raised"]).axes
    q = support.configurations(pose[0])
    chain = support.chain
    ends = [
        np.array(point.point) if point.link == "universe" else chain.placement(q, point.link).act(np.array(point.point))
        for point in spring.route.points
    ]
    assert has(ax, seen(ends))
    assert not [text for text in ax.texts if text.get_text().isdigit()]


@pytest.mark.parametrize("side", ["left", "right"])
def test_three_views_of_a_design(side):
    exo = ep.load("four-cables", side=side).worn_by(MAN)
    pose = exo.pose([60.0], [20.0])
    figure = design_drawing(exo, pose, np.array([1.2]))
    R, body = pose.as_matrix()[0], ep.BodyShape.of(ep.Wearer(1.75, 75, "male", elbow_flexion=1.2), side)
    ends = exo.geometry.platform_points @ R.T
    every = []
    for ax, (first, second, leftward) in zip(figure.axes, ((1, 2, False), (0, 2, True), (1, 0, True)), strict=True):
        plane = [first, second]
        for a, b in zip(exo.geometry.base_points, ends, strict=True):
            assert has(ax, 1e3 * np.array([a, b])[:, plane])
            for joint, marker in ((a, "s"), (b, "o")):
                drawn = [line for line in ax.get_lines() if line.get_marker() == marker]
                assert any(np.allclose(line.get_xydata(), 1e3 * joint[plane]) for line in drawn)
        rows = [(row, np.eye(3)) for row in body.torso] + [(row, R) for row in body.arm]
        outlines = ax.patches[: len(rows)]
        for patch, (row, turn) in zip(outlines, rows, strict=True):
            assert is_outline(patch, (1e3 * (turn @ row[:3])[plane], 1e3 * (turn @ row[3:6])[plane], 1e3 * row[6]))
        (cross,) = [line for line in ax.get_lines() if line.get_marker() == "+"]
        np.testing.assert_array_equal(cross.get_xydata(), [[0.0, 0.0]])
        low, high = ax.get_xlim()
        assert (low > high) == leftward
        every += [patch.get_xy() for patch in outlines]
        reach = np.concatenate([patch.get_xy() for patch in outlines])
        assert sorted(ax.get_xlim())[0] <= reach[:, 0].min() - 29.0
        assert sorted(ax.get_ylim())[1] >= reach[:, 1].max() + 29.0
    seen_from = figure.subfigs[0].get_suptitle()
    found = exo.accuracy(pose[0])
    assert seen_from.startswith("flexion 60°, abduction 20°")
    assert "elbow 69°" in seen_from
    assert f"weakest rate {float(found.mm_per_degree):.2g} mm/°" in seen_from
    assert seen_from.endswith("twin") == bool(found.has_twin)
    assert exo.mechanism.title.split()[0] in figure.get_suptitle()
