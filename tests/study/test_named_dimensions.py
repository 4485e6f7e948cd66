"""Dimensions of a design by name: what each changes, and that searches take the same names."""

import numpy as np
import pytest

import exo_pin as ep
from exo_pin.design.parameters.changes import value_of, with_values
from exo_pin.design.parameters.names import parameter
from exo_pin.workspace.optimisation.search_poses import DesignVariables


def test_each_name_changes_what_it_says():
    exo, cables = ep.load("four-linear-actuators"), ep.load("four-cables").mechanism
    base, platform = exo.geometry.base_points, exo.geometry.platform_points

    def changed(name, value, mechanism=exo.mechanism):
        named = parameter(name)
        return with_values(mechanism, {named: named.in_si(value)})

    height = -platform[:, 2].mean()
    moved = changed("cuff_height_mm", 1e3 * height + 20.0).geometry.platform_points
    np.testing.assert_allclose(moved, platform - [0, 0, 0.02], atol=1e-12)
    larger = changed("scale", 1.1)
    np.testing.assert_allclose(larger.geometry.base_points, 1.1 * base)
    for old, new in zip(exo.limbs, larger.limbs, strict=True):
        assert new.stroke.nominal_length == pytest.approx(1.1 * old.stroke.nominal_length)
        assert (new.stroke.shortest, new.actuator.pull_limit) == (old.stroke.shortest, old.actuator.pull_limit)
    # Forces of a device that is larger as a whole are smaller alike, with the arm and its weight as they are.
    poses = exo.pose([20.0, 60.0], 30.0)
    forces = [each.reaction(poses, limits="none").actuator_forces for each in (exo, exo.from_mechanism(larger))]
    np.testing.assert_allclose(forces[1], forces[0] / 1.1, rtol=1e-8)
    radius = changed("A.radius_mm", 150.0).geometry.base_points
    np.testing.assert_allclose(np.linalg.norm(radius, axis=1), 0.15)
    assert changed("B[2].drop_mm", 200.0).geometry.platform_points[1, 2] == pytest.approx(-0.2)
    assert [limb.actuator.pull_limit for limb in changed("pull_limit[3]", 50.0).limbs].count(50.0) == 1
    assert {limb.actuator.least_tension for limb in changed("least_tension_N", 5.0, cables).limbs} == {5.0}
    assert [limb.kind for limb in changed("limb_kind", "UPU").limbs] == ["UPU"] * 4
    assert changed("limb_kind", "UPU").limbs[0].actuator == exo.limbs[0].actuator
    # Whatever can be searched has its own value in the design.
    for key in ("cuff_height", "A[1].azimuth", "B[4].radius", "nominal_length[2]", "end_fitting[2]"):
        named = parameter(key)
        same = with_values(exo.mechanism, {named: value_of(exo.mechanism, named)})
        np.testing.assert_allclose(same.geometry.base_points, base, atol=1e-12)
        np.testing.assert_allclose(same.geometry.platform_points, platform, atol=1e-12)
    # One language: a search takes the same names, units and texts.
    space = DesignVariables(exo.mechanism, {"A[1].azimuth_deg": "-90:90", "cuff_height": (0.1, 0.3)})
    np.testing.assert_allclose(space.bounds, [[-np.pi / 2, np.pi / 2], [0.1, 0.3]])
    assert space.of_design()["cuff_height"] == pytest.approx(height)
