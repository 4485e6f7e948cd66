"""Frame and cuff that could hold a design's joints: closed forms of their mass, and a search that takes it."""

import numpy as np
import pytest

import exo_pin as ep
from exo_pin import MissingData
from exo_pin.design.holding_frame import (
    device_mass,
    estimated_cuff,
    estimated_frame_mass,
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
