"""Frame and cuff that could hold a design's joints: closed forms of their mass, and a search that takes it."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import MissingData
from exo_pin.design.holding_frame import (
    device_mass,
    estimated_cuff,
    estimated_frame_mass,
    frame_parts,
    holding_bars,
    mass_text,
    sleeve_size,
    with_cuff_by_geometry,
)
from exo_pin.workspace import Criteria, free_joints, lifting_poses
from exo_pin.workspace.optimisation.merit import Merit
from exo_pin.workspace.optimisation.search_poses import DesignVariables

#: A square of joints, 0.1 m from the arm's axis and 0.15 m below the shoulder.
TURNS = np.radians([45.0, 135.0, 225.0, 315.0])
SQUARE = np.stack([0.1 * np.cos(TURNS), 0.1 * np.sin(TURNS), np.full(4, -0.15)], axis=1)
PER_METRE = 2700.0 * np.pi * (0.0065**2 - 0.005**2)


def square():
    return ep.WristGeometry(np.array([[0.3, 0.1, 0.2], [-0.3, 0.1, 0.2], [-0.3, 0.1, -0.2], [0.3, 0.1, -0.2]]), SQUARE)


def test_mass_of_a_square_by_hand():
    cuff = estimated_cuff(square())
    bow, struts = 0.75 * 2.0 * np.pi * 0.1, 4 * (0.1 - 0.066)
    sleeve = 1200.0 * 2.0 * np.pi * 0.066 * 0.004 * 0.06
    assert cuff.mass == pytest.approx(PER_METRE * (bow + struts) + 4 * 0.05 + sleeve, rel=2e-3)
    assert cuff.device
    assert sleeve_size(SQUARE) == pytest.approx((0.066, -0.18, -0.12))
    # The bow is open to one side.
    assert 0.001 < np.hypot(*cuff.centre_of_mass[:2]) < 0.02
    assert cuff.centre_of_mass[2] == pytest.approx(-0.15)
    assert np.linalg.eigvalsh(cuff.inertia)[0] > 0.0
    # As a ring of 0.1 m about the axis, but for sleeve and struts.
    assert cuff.mass * 0.066**2 < cuff.inertia[2, 2] < cuff.mass * 0.1**2


def test_frame_passes_all_joints():
    (bar,) = holding_bars(square())[0]
    for point in square().base_points:
        assert np.linalg.norm(bar - point, axis=1).min() < 1e-12
    length = np.linalg.norm(np.diff(bar, axis=0), axis=1).sum()
    assert estimated_frame_mass(square()) == pytest.approx(PER_METRE * length + 0.2, rel=1e-12)


def turned_square(points):
    """Joints of both ends in a turned base frame, the frame's bow about a turned axis."""
    turn = Rotation.from_euler("xyz", [0.4, -0.7, 1.1])
    return turn, ep.WristGeometry(turn.apply(points), SQUARE, base_axis=turn.apply([0.0, 0.0, 1.0]))


def test_a_bow_goes_round_its_axis_and_is_open_at_the_widest_gap():
    """About an axis in any direction; radius and height go evenly from joint to joint."""
    angles, radii, heights = np.radians([10.0, 60.0, 150.0, -70.0]), [0.2, 0.3, 0.25, 0.15], [0.1, 0.2, 0.0, 0.15]
    points = np.stack([radii * np.cos(angles), radii * np.sin(angles), heights], axis=1)
    turn, geometry = turned_square(points)
    ((bar,), cuff) = holding_bars(geometry)
    own = turn.inv().apply(bar)
    along, size = np.unwrap(np.arctan2(own[:, 1], own[:, 0])), np.hypot(own[:, 0], own[:, 1])
    if along[0] > along[-1]:
        along, size, own = along[::-1], size[::-1], own[::-1]
    # Gaps are 80°, 50°, 90° and 140°: from -70° to 150°.
    np.testing.assert_allclose(np.degrees(along[[0, -1]]), [-70.0, 150.0], atol=1e-9)
    assert (np.diff(along) > 0.0).all()
    assert np.degrees(np.diff(along)).max() <= 5.0 + 1e-9
    order = [3, 0, 1, 2]
    np.testing.assert_allclose(size, np.interp(along, angles[order], np.array(radii)[order]), atol=1e-12)
    np.testing.assert_allclose(own[:, 2], np.interp(along, angles[order], np.array(heights)[order]), atol=1e-12)
    # From the sleeve to each joint of the square, level.
    assert len(cuff) == 5
    for strut, joint in zip(cuff[1:], SQUARE, strict=True):
        np.testing.assert_allclose(strut[-1], joint, atol=1e-15)
        np.testing.assert_allclose(strut[0], [*(0.66 * joint[:2]), -0.15], atol=1e-15)
        np.testing.assert_allclose(strut[1], 0.5 * (strut[0] + strut[-1]), atol=1e-15)


def test_a_sleeve_covers_its_joints():
    for points, want in (
        ([[0.05, 0.0, -0.20], [0.0, 0.09, -0.26]], (0.0435, -0.27, -0.19)),
        ([[0.02, 0.0, -0.20], [0.0, 0.09, -0.20]], (0.03, -0.23, -0.17)),
        # As near to O as its middle may come.
        ([[0.2, 0.0, -0.01], [0.0, 0.2, -0.05]], (0.066, -0.105, -0.045)),
    ):
        assert sleeve_size(np.array(points)) == pytest.approx(want)
    # The feet of struts stay on it: joints above its top stand on its upper rim.
    high = SQUARE + np.array([0.0, 0.0, 0.15])
    geometry = ep.WristGeometry(square().base_points, high)
    top = sleeve_size(high)[2]
    for strut in holding_bars(geometry)[1][1:]:
        assert strut[0][2] == pytest.approx(top - 0.0065)
    near = SQUARE * [0.76, 0.76, 1.0]
    assert len(holding_bars(ep.WristGeometry(square().base_points, near))[1]) == 1


def test_inertia_of_the_cuff_by_its_parts():
    """Sleeve in closed form, bars as pieces at their middles, joints as points; the list of parts weighs the same."""
    geometry = ep.load("four-cables").geometry
    points, cuff = np.asarray(geometry.platform_points), estimated_cuff(geometry)
    radius, bottom, top = sleeve_size(points)
    shell, high = 1200.0 * 2.0 * np.pi * radius * 0.004 * (top - bottom), top - bottom
    bars = holding_bars(geometry)[1]
    at = np.concatenate([points, *((bar[1:] + bar[:-1]) / 2.0 for bar in bars)])
    mass = np.concatenate([np.full(len(points), 0.05), *(
        PER_METRE * np.linalg.norm(np.diff(bar, axis=0), axis=1) for bar in bars)])  # fmt: skip
    middle = np.array([0.0, 0.0, 0.5 * (bottom + top)])
    total = mass.sum() + shell
    centre = (mass @ at + shell * middle) / total
    assert cuff.mass == pytest.approx(total, rel=1e-12)
    np.testing.assert_allclose(cuff.centre_of_mass, centre, atol=1e-12)
    across = shell * (radius**2 / 2.0 + high**2 / 12.0 * (1.0 - 1.0 / 25.0))
    inertia = np.diag([across, across, shell * radius**2])
    for weight, spot in [(shell, middle), *zip(mass, at, strict=True)]:
        off = spot - centre
        inertia += weight * (off @ off * np.eye(3) - np.outer(off, off))
    np.testing.assert_allclose(cuff.inertia, inertia, atol=1e-12)
    rows = {name: (count, length, weight) for name, count, length, weight, _ in frame_parts(geometry)}
    assert rows["sleeve of the cuff"][1:] == pytest.approx((high, shell))
    assert rows["joints"][0] == 2 * len(points)
    assert rows["joints"][2] == pytest.approx(0.1 * len(points))
    own = sum(float(np.linalg.norm(np.diff(bar, axis=0), axis=1).sum()) for bar in bars)
    assert rows["bars of the cuff"] == pytest.approx((1, own, PER_METRE * own))
    whole = sum(weight for *_, weight in rows.values())
    assert whole == pytest.approx(estimated_frame_mass(geometry) + cuff.mass)
    texts = {name: text for name, *_, text in frame_parts(geometry)}
    assert texts["bars of the frame"] == "aluminium tube 13 x 1.5 mm, bent"
    assert texts["sleeve of the cuff"] == f"plastic, 4 mm, inner radius {1e3 * radius:.0f} mm"


@pytest.mark.parametrize("name", ["four-cables", "four-linear-actuators-worn", "prototype"])
def test_mirror_image_weighs_the_same(name):
    left, right = (estimated_cuff(ep.load(name, side=side).geometry) for side in ("left", "right"))
    assert left.mass == pytest.approx(right.mass, rel=1e-4)
    np.testing.assert_allclose(left.centre_of_mass * [1, -1, 1], right.centre_of_mass, atol=1e-4)


def test_cuff_of_each_design_in_a_search():
    pytest.importorskip("optuna", reason="needs the extra optimise: pip install '.[optimise]'")
    exo = ep.load("four-cables")
    space = DesignVariables(exo.mechanism, free_joints(4), by_geometry=True)
    values = space.of_design() | {"B[1].radius": 0.05}
    made = [space.design(each) for each in (space.of_design(), values)]
    for design in made:
        assert design.arm.mass == pytest.approx(exo.arm.person.mass + estimated_cuff(design.geometry).mass)
    assert made[1].arm.mass < made[0].arm.mass
    found = ep.optimise(
        exo, free_joints(4), lifting_poses(counts=(2, 2, 2)), budget=24, finer_step=30.0, cuff_by_geometry=True
    )
    best = found.best.mechanism
    assert f"Moving mass besides the arm: {estimated_cuff(best.geometry).mass:.2f} kg." in " ".join(str(found).split())
    assert "the design does not state the mass of its drives" in " ".join(str(found).split())
    assert best.arm.mass == pytest.approx(exo.arm.person.mass + estimated_cuff(best.geometry).mass)
    assert best.arm.wearer is not None


def test_drives_weigh_what_the_design_states():
    exo = ep.load("four-cables")
    rod = ep.LimbBody.rod(0.4, 0.2, 0.01)
    heavy = exo.replace(limbs=[ep.Limb("SPS", rod, stroke=each.stroke, actuator=each.actuator) for each in exo.limbs])
    assert device_mass(heavy.mechanism) == pytest.approx(device_mass(exo.mechanism) + 4 * 0.4)
    assert "drives 1.60 kg, as the design states" in mass_text(heavy.mechanism)
    assert "does not state the mass of its drives" in mass_text(exo.mechanism)


def test_the_devices_mass_as_an_objective():
    """What is added to the merit is its weight times the mass in kg."""
    exo = ep.load("four-cables")
    judge = Merit(DesignVariables(exo.mechanism, free_joints(4)), lifting_poses(counts=(2, 2, 2)), Criteria())
    point = judge.variables.point(judge.variables.of_design())
    found, plain = judge.evaluate(point, {"device_mass": 0.5}), judge.evaluate(point, {})
    mass = device_mass(judge.variables.design(judge.variables.values(point)))
    assert found.objectives["device_mass"] == pytest.approx(mass, rel=1e-12)
    assert found.merit - plain.merit == pytest.approx(0.5 * mass, rel=1e-9)


def test_what_it_needs():
    with pytest.raises(MissingData, match="arm"):
        with_cuff_by_geometry(ep.load("scenario-one").mechanism)
    with pytest.raises(MissingData, match="a person's arm"):
        with_cuff_by_geometry(ep.load("prototype").mechanism)
    worn = ep.load("four-cables").mechanism
    made = with_cuff_by_geometry(worn)
    assert made.arm.person.mass == pytest.approx(worn.arm.person.mass)
    assert made.arm.mass == pytest.approx(worn.arm.person.mass + estimated_cuff(worn.geometry).mass)
