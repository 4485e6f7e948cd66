"""Every named mechanism against an answer derived by hand."""

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import five_bar, four_bar, parallelogram, planar_3rrr, unit
from scipy.spatial.transform import Rotation
from spatial_mechanisms import DELTA, agile_eye, delta, delta_points, stewart, stewart_points

from exo_pin import LoopNotClosed

UP = np.array([0.0, 0.0, 1.0])


def test_four_bar_rates_and_margins():
    # With the crank at rate 1 the coupler turns at 0.36 and the rocker at 0.84 (derived beside the weight's torque).
    named = four_bar()
    chain = named.chain()
    G = chain.reduced_jacobian(named.q, ["crank_hinge"])
    np.testing.assert_allclose(G[:, 0], [1.0, 0.36 - 1.0, 0.84], atol=1e-14)
    margins = chain.mobility(named.q, frame="rocker", part="orientation").margins
    assert margins.effort == pytest.approx({"N m per N m": 0.84})
    assert margins.travel == pytest.approx({"rad per rad": 1 / 0.84})


def five_bar_at(tip, sides):
    """Configuration of the five-bar with its tip at a point, elbows on given sides, by the cosine rule."""
    q = []
    for x, side in zip((-0.1, 0.1), sides, strict=True):
        way = np.asarray(tip) - [x, 0.0]
        reach = np.hypot(*way)
        cosine = (0.2**2 + reach**2 - 0.275**2) / (2 * 0.2 * reach)
        crank = np.arctan2(way[1], way[0]) + side * np.arccos(np.clip(cosine, -1, 1))
        elbow = np.array([x, 0.0]) + 0.2 * np.array([np.cos(crank), np.sin(crank)])
        forearm = np.arctan2(*(np.asarray(tip) - elbow)[::-1])
        q += [crank, forearm - crank]
    return np.array(q)


def test_five_bar_singular_kinds():
    chain = five_bar().chain()
    regular = chain.mobility(five_bar_at((0.02, 0.3), (1, -1)), frame="tip", part="position")
    assert regular.kinds == ()
    # Left crank and forearm in line: the tip stands still for a turn of the left crank.
    angle = np.radians(60.0)
    stretched = five_bar_at((-0.1 + 0.475 * np.cos(angle), 0.475 * np.sin(angle)), (1, -1))
    stretched[:2] = angle, 0.0  # the cosine rule loses half of the digits there
    mobility = chain.mobility(stretched, frame="tip", part="position")
    assert mobility.kinds == ("input",)
    assert mobility.margins.travel["rad per m"] == np.inf
    # Both forearms in line, elbows 0.55 apart: the locked cranks do not hold the tip.
    angle = np.arccos((0.275 - 0.1) / 0.2)
    flat = np.array([np.pi - angle, np.pi + angle, angle, np.pi - angle])
    flat[1] = -flat[0]
    mobility = chain.mobility(flat, frame="tip", part="position")
    assert mobility.kinds == ("output",)
    assert mobility.locked.degrees_of_freedom == 1
    assert mobility.margins.effort["N m per N"] == np.inf
    # Near either, the margin grows as one over the sine of the angle that is left.
    near = [
        chain.mobility(
            five_bar_at((-0.1 + reach * np.cos(1.0), reach * np.sin(1.0)), (1, -1)), frame="tip", part="position"
        ).margins.travel["rad per m"]
        for reach in (0.475 - 1e-4, 0.475 - 1e-6)
    ]
    assert near[1] / near[0] == pytest.approx(10, rel=0.05)


def test_planar_3rrr_by_its_rods():
    # A rod sees the same of both of its ends: u (v + ω × p) = rate u (z × crank).
    named = planar_3rrr()
    chain = named.chain()
    places = chain.placements(named.q)
    A, B = np.zeros((3, 3)), np.zeros((3, 3))
    for i, angle in enumerate(np.radians([90.0, 210.0, 330.0])):
        tip = 0.1 * np.array([np.cos(angle), np.sin(angle), 0.0])
        elbow, base = places[f"distal_{i}"].translation, places[f"proximal_{i}"].translation
        u, lever = unit(tip - elbow), tip - places["platform"].translation
        A[i] = u[0], u[1], np.cross(lever, u)[2]
        B[i, i] = u @ np.cross(UP, elbow - base)
    J = chain.frame_jacobian(named.q, "platform", chain.roles.actuated)
    np.testing.assert_allclose(J[[0, 1, 5]], np.linalg.solve(A, B), atol=1e-14)
    mobility = chain.mobility(named.q)
    # Two revolute closures in the plane say three things twice each: out of the plane nothing moves anyway.
    assert (mobility.degrees_of_freedom, mobility.redundant) == (3, 6)
    assert dict(mobility.redundant_closures) == {"tip_1": 3, "tip_2": 3}
    assert mobility.kinds == ()


def test_planar_3rrr_turns_where_its_rods_meet():
    named = planar_3rrr(radial=True)
    mobility = named.chain().mobility(named.q)
    assert mobility.kinds == ("output",)
    assert mobility.locked.degrees_of_freedom == 1
    assert mobility.margins.effort["N m per N m"] == np.inf


def test_agile_eye_is_isotropic_at_home_and_turned_by_its_closed_form():
    named = agile_eye()
    chain = named.chain()
    # ω w×v = rate u w×v, and w×v = u at home.
    J = chain.frame_jacobian(named.q, "platform", chain.roles.actuated)
    np.testing.assert_allclose(J, np.vstack([np.zeros((3, 3)), np.eye(3)]), atol=1e-14)
    mobility = chain.mobility(named.q)
    assert (mobility.degrees_of_freedom, mobility.rank, mobility.redundant) == (3, 4, 6)
    assert mobility.margins.effort["N m per N m"] == pytest.approx(1.0)
    rng = np.random.default_rng(0)
    axes = np.eye(3)
    for _ in range(5):
        turn = Rotation.from_rotvec(rng.uniform(-0.5, 0.5, 3))
        q = chain.inverse_kinematics("platform", pin.SE3(turn.as_matrix(), np.zeros(3)), named.q)
        assert np.abs(chain.residual(q)).max() <= 1e-12
        for i in range(3):
            # The middle axis is at right angles to the motor's and to the platform's.
            u, w, v = axes[i], axes[(i + 1) % 3], turn.apply(axes[(i + 2) % 3])
            middle = unit(np.cross(v, u))
            expected = np.arctan2(np.cross(w, middle) @ u, w @ middle)
            assert q[chain.configuration_slice(f"motor_{i}")] == pytest.approx(expected, abs=1e-10)


@pytest.mark.parametrize("legs", ["rods", "universal", "rigid"])
def test_delta_by_its_rods(legs):
    named = delta(legs)
    chain = named.chain()
    A, B = np.zeros((3, 3)), np.zeros((3, 3))
    for i in range(3):
        hinge, axis, elbow, joint, _ = delta_points(i)
        A[i] = joint - elbow
        B[i, i] = A[i] @ np.cross(axis, elbow - hinge)
    J = chain.frame_jacobian(named.q, "platform", chain.roles.actuated)
    np.testing.assert_allclose(J, np.vstack([np.linalg.solve(A, B), np.zeros((3, 3))]), atol=1e-13)
    mobility = chain.mobility(named.q)
    assert (mobility.degrees_of_freedom, mobility.redundant, mobility.idle, mobility.kinds) == (3, 0, 0, ())
    gain = np.linalg.norm(np.linalg.solve(A, B), 2)
    assert mobility.margins.effort["N m per N"] == pytest.approx(gain)


@pytest.mark.parametrize("legs", ["rods", "universal", "rigid"])
def test_delta_forward_and_inverse_kinematics_in_closed_form(legs):
    named = delta(legs)
    chain = named.chain()
    r_base, arm, rod, r_platform, _ = DELTA
    rng = np.random.default_rng(1)
    for _ in range(4):
        angles = rng.uniform(-0.4, 0.4, 3)
        q = chain.forward_kinematics(angles, named.q)
        # The centre is a rod away from three points: the elbows, moved in by the platform's radius.
        points = []
        for i, angle in enumerate(angles):
            _, axis, _, _, _ = delta_points(i)
            ray = np.cross(axis, UP)
            points.append((r_base - r_platform) * ray + arm * Rotation.from_rotvec(angle * axis).apply(ray))
        centre = below(points, rod)
        place = chain.placement(q, "platform")
        offset = delta_points(0)[3] - delta_points(0)[4] if legs != "rods" else np.zeros(3)
        np.testing.assert_allclose(place.translation - offset, centre, atol=1e-10)
        np.testing.assert_allclose(place.rotation, np.eye(3), atol=1e-10)
        back = chain.inverse_kinematics("platform", place, named.q, "position")
        slices = [chain.configuration_slice(f"motor_{i}").start for i in range(3)]
        np.testing.assert_allclose(back[slices], angles, atol=1e-10)
    with pytest.raises(LoopNotClosed):
        chain.inverse_kinematics("platform", pin.SE3(np.eye(3), np.array([0.0, 0.0, -0.8])), named.q, "position")


def below(points, radius):
    """The lower intersection of three spheres of equal radius."""
    a, b, c = points
    normal = np.cross(b - a, c - a)
    if normal[2] > 0:
        normal = -normal
    # Circumcentre, then down by what is left of the radius.
    ab, ac, n = b - a, c - a, np.cross(b - a, c - a)
    to_centre = (np.cross(n, ab) * (ac @ ac) + np.cross(ac, n) * (ab @ ab)) / (2 * n @ n)
    return a + to_centre + unit(normal) * np.sqrt(radius**2 - to_centre @ to_centre)


def test_stewart_by_its_legs():
    named = stewart()
    chain = named.chain()
    base, platform = stewart_points()
    place = chain.placement(named.q, "platform")
    tips = platform @ place.rotation.T + place.translation
    legs = (tips - base) / np.linalg.norm(tips - base, axis=1, keepdims=True)
    inverse = np.hstack([legs, np.cross(tips - place.translation, legs)])
    J = chain.frame_jacobian(named.q, "platform", chain.roles.actuated)
    np.testing.assert_allclose(J, np.linalg.inv(inverse), atol=1e-12)
    mobility = chain.mobility(named.q)
    assert (mobility.degrees_of_freedom, mobility.redundant, mobility.kinds) == (6, 0, ())
    assert mobility.margins.effort["N per N m"] == pytest.approx(np.linalg.norm(np.linalg.inv(inverse)[3:], 2))
    assert mobility.margins.travel["m per m"] == pytest.approx(np.linalg.norm(inverse[:, :3], 2))
    # To another pose: the slides are the legs' lengths.
    target = place * pin.exp6(np.array([0.05, -0.03, 0.02, 0.1, -0.2, 0.15]))
    q = chain.inverse_kinematics("platform", target, named.q)
    moved = platform @ target.rotation.T + target.translation
    lengths = np.linalg.norm(moved - base, axis=1) - np.linalg.norm(tips - base, axis=1)
    slides = [chain.configuration_slice(f"slide_{i}").start for i in range(6)]
    np.testing.assert_allclose(q[slides], lengths, atol=1e-11)
    back = chain.forward_kinematics(lengths, named.q)
    assert pin.log6(chain.placement(back, "platform").actInv(target)).vector == pytest.approx(np.zeros(6), abs=1e-10)


def test_redundant_parallelogram():
    named = parallelogram()
    chain = named.chain()
    mobility = chain.mobility(named.q)
    # Six rows: two out of the plane, and of the other four one is said twice.
    assert (mobility.degrees_of_freedom, mobility.rank, mobility.redundant) == (1, 3, 3)
    assert dict(mobility.redundant_closures) == {"tip_1": 2, "tip_2": 2}
    assert mobility.kinds == ()
    # The bar moves in parallel, at right angles to the cranks.
    J = chain.frame_jacobian(named.q, "bar", ["hinge_0"])
    np.testing.assert_allclose(J[:, 0], [-0.2 * np.sin(1.0), 0.2 * np.cos(1.0), 0, 0, 0, 0], atol=1e-15)
    flat = parallelogram(0.0)
    mobility = flat.chain().mobility(flat.q)
    # All cranks along the bar: it may tilt as well as rise, to first order.
    assert mobility.degrees_of_freedom == 2
    assert mobility.kinds == ("constraint", "output")
    for angle in (0.5, 1.0, 2.0):
        q = chain.forward_kinematics([angle], named.q)
        hinges = [q[chain.configuration_slice(f"hinge_{i}").start] for i in range(3)]
        np.testing.assert_allclose(hinges, angle, atol=1e-11)
