"""Pneumatic muscles over via points as the drives of a device: their limits."""

import numpy as np
import pytest
from arm_alone import arm_alone

import exo_pin as ep
from exo_pin.device import ChainDevice, Drive, Route
from exo_pin.muscle import Muscle, muscle_model

LAW = ep.Actuator("pneumatic muscle", force_law="best", supply_pressure=4e5)


def with_muscles():
    """The four limbs of a preset as muscles along the same lines, and the preset with these muscles."""
    exo = ep.load("four-cables")
    lengths = exo.inverse_kinematics(exo.pose(30, 30)).lengths
    strokes = [ep.Stroke(0.2, 0.75, 1.0, float(length) - 0.18) for length in lengths]
    limbs = [ep.Limb("SPS", stroke=stroke, actuator=LAW) for stroke in strokes]
    return exo.replace(limbs=limbs)


def as_routes(exo):
    """The same muscles as routes from torso to arm, on a chain without any link of a device."""
    geometry = exo.mechanism.geometry
    drives = []
    for k, (a, b) in enumerate(zip(geometry.base_points, geometry.platform_points, strict=True)):
        route = Route.over(("universe", a), ("arm", b))
        limb = exo.mechanism.limbs[k]
        drives.append(Drive(f"muscle_{k}", route=route, actuator=limb.actuator, stroke=limb.stroke))
    return ep.ShoulderExo.from_device(ChainDevice(arm_alone(), tuple(drives), arm=exo.arm))


def test_muscles_along_routes_have_the_forces_of_a_wrists():
    exo = with_muscles()
    device, load = as_routes(exo), ep.Load((0.2, 0.1, -0.5), at=(0.0, 0.0, -0.3))
    poses = exo.pose([30, 33], [30, 30])
    law = muscle_model("best", 0.2)
    muscles = [
        Muscle(model=law, end_fitting=limb.stroke.end_fitting, supply_pressure=4e5, least_pressure=1.5e5)
        for limb in exo.mechanism.limbs
    ]
    for limits in ("design", muscles):
        one, other = (own.reaction(poses, load=load, split="minimal", limits=limits) for own in (exo, device))
        assert one.held.any()
        np.testing.assert_array_equal(one.held, other.held)
        np.testing.assert_allclose(other.actuator_forces, one.actuator_forces, rtol=1e-6, atol=1e-8)


def test_a_muscle_over_a_via_point_is_limited_by_pressure_and_contraction(tmp_path):
    device = as_routes(with_muscles())
    first, *others = device.device.drives
    a, b = (np.array(point.point) for point in first.route.points)
    route = Route.over(("universe", a), ("universe", 0.7 * a + 0.3 * b + [0.0, 0.03, 0.0]), ("arm", b))
    pose = device.pose(30, 30)
    length = np.linalg.norm(np.diff([a, 0.7 * a + 0.3 * b + [0.0, 0.03, 0.0], pose.apply(b)], axis=0), axis=1).sum()
    stroke = ep.Stroke(0.2, 0.75, 1.0, float(length) - 0.18)
    device = device.replace(drives=[Drive(first.name, route=route, actuator=LAW, stroke=stroke), *others])
    answer = device.reaction(pose)
    upper = answer.source.poses.limits.upper[0, 0]
    # 20 mm of contraction at the greatest pressure, by the law itself.
    assert upper == pytest.approx(float(muscle_model("best", 0.2).force(0.02, 4e5)), rel=1e-9)
    # The file says all of it.
    assert ep.load(device.to_urdf(tmp_path)).device.drives == device.device.drives
    # Longer than it is at rest, the muscle has no answer.
    short = ep.Stroke(0.2, 0.75, 1.0, float(length) - 0.21)
    long = device.replace(drives=[Drive(first.name, route=route, actuator=LAW, stroke=short), *others])
    assert long.reaction(pose).status == "out_of_stroke"
