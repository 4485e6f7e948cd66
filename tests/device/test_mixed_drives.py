"""Devices with slides and hinges as drives: one margin, whatever the unit of length and the size of a crank."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from idle_devices import Builder, random_device

import exo_pin as ep
from exo_pin.chain import Closure, Placement
from exo_pin.device import ChainDevice

POSES = ep.shoulder_rotation(*np.radians([[10.0, 30.0, -20.0], [5.0, 25.0, 40.0], [0.0, 10.0, -15.0]]))
METRE = 2.0


def in_other_units(device):
    """The device in units of 0.5 m; limits of coordinates and efforts are left as they are."""
    chain, arm, model = device.chain, device.arm, device.chain.model.copy()
    for joint in range(1, model.njoints):
        own = model.inertias[joint]
        model.inertias[joint] = pin.Inertia(own.mass, METRE * own.lever, METRE**2 * own.inertia)
        model.jointPlacements[joint].translation *= METRE
    for frame in model.frames:
        frame.placement.translation *= METRE
    model.gravity.linear *= METRE

    def moved(place):
        return replace(place, translation=tuple(METRE * np.array(place.translation)))

    closures = tuple(
        replace(loop, placement_a=moved(loop.placement_a), placement_b=moved(loop.placement_b))
        for loop in chain.closures
    )
    other = ep.ClosedChain(model, replace(chain.description, closures=closures))
    own = ep.Arm(arm.mass, METRE * arm.centre_of_mass, METRE**2 * arm.inertia)
    return ChainDevice.from_chain(other).replace(arm=own, drives=device.drives, brakes=device.brakes)


@pytest.mark.parametrize("seed", [3, 7, 11])
def test_the_unit_of_length_changes_no_margin(seed):
    device, kind = random_device(seed)
    assert kind.startswith("both")  # three hinges and one or two slides
    one, other = (
        ep.ShoulderExo.from_device(each).reaction(POSES, limits="none") for each in (device, in_other_units(device))
    )
    np.testing.assert_allclose(other.margin, one.margin, rtol=1e-7)
    np.testing.assert_array_equal(other.status, one.status)
    mirrored = ep.ShoulderExo.from_device(device.mirrored())
    opposite = np.diag([1.0, -1.0, 1.0]) @ POSES.as_matrix() @ np.diag([1.0, -1.0, 1.0])
    image = mirrored.reaction(POSES.__class__.from_matrix(opposite), limits="none")
    np.testing.assert_allclose(image.margin, one.margin, rtol=1e-7)


def on_a_crank(radius):
    """Three hinges through O at right angles, the first turned by a slide on a crank: rod and crank meet at 90°."""
    build = Builder(np.random.default_rng(0))
    parent = 0
    for k, axis in enumerate(np.eye(3)):
        kind = pin.JointModelRevoluteUnaligned(*axis)
        parent = build.add(parent, kind, np.zeros(3), f"hinge_{k}", 0.5, np.zeros(3))
        build.drive(f"hinge_{k}", 30.0)
    build.loops.append(Closure("frame", "rigid", "hinge_2_link", "arm"))
    if radius:
        # Along z from far below, to a crank along y of the hinge about x.
        tube = build.add(0, pin.JointModelSpherical(), [0.0, radius, -100.0 * radius], "ball", 0.0, np.zeros(3))
        build.add(tube, pin.JointModelPZ(), [0.0, 0.0, 100.0 * radius], "slide", 0.0, np.zeros(3))
        crank = Placement((0.0, radius, 0.0))
        build.loops.append(Closure("crank", "spherical", "slide_link", "hinge_0_link", Placement(), crank))
        build.drives.pop(0)
        build.drive("slide", 300.0)
    device = build.device()
    return ep.ShoulderExo.from_device(device)


def test_a_slide_on_a_crank_counts_as_the_hinge_that_it_turns():
    hinges, crank, larger = (on_a_crank(radius) for radius in (0.0, 0.05, 0.2))
    one, two, three = (each.reaction(POSES, limits="none") for each in (hinges, crank, larger))
    np.testing.assert_allclose(three.margin, two.margin, rtol=1e-9)
    np.testing.assert_allclose(three.actuator_forces[:, 2], two.actuator_forces[:, 2] / 4.0, rtol=1e-6)
    # The crank has turned by up to 45°, so that its lever is 0.7 to 1 times its radius.
    np.testing.assert_allclose(two.margin, one.margin, rtol=0.2)
    # Up to the dead centre, where crank and rod are in line: the hinges stay at right angles.
    angles = np.radians([0.0, 30.0, 60.0, 85.0, 89.0])
    end = np.stack([0.0 * angles, np.cos(angles), np.sin(angles)], axis=1)
    rod = end - [0.0, 1.0, -100.0]
    lever = np.cross(end, rod)[:, 0] / np.linalg.norm(rod, axis=1)
    margin = crank.reaction(crank.pose(0.0, np.degrees(angles)), limits="none").margin
    mean = 0.05 * lever / crank.device.structure.scales[2]
    np.testing.assert_allclose(margin, 3.0 / np.sqrt((mean**2 + 2.0) * (mean**-2.0 + 2.0)), rtol=1e-6)
    assert crank.device.structure.scales[:2] == (1.0, 1.0)
    assert 0.9 * 0.05 < crank.device.structure.scales[2] < 1.1 * 0.05


def test_the_margin_of_strokes_has_the_unit_of_the_drives():
    """Rad of hinges; travel of a slide beside them counts over its mean lever."""
    for radius, unit in ((0.0, "rad"), (0.05, "rad")):
        exo = on_a_crank(radius)
        ends = {"hinge_0": 0.8, "hinge_1": 0.9, "hinge_2": 0.7, "slide": 0.04}
        drives = [replace(drive, least=-ends[drive.name], greatest=ends[drive.name]) for drive in exo.device.drives]
        exo = exo.replace(drives=drives).worn_by(ep.Wearer(1.75, 75.0, "male"))
        found = exo.workspace(POSES, ["stroke"])
        room = np.array([ends[drive.name] for drive in drives]) - np.abs(exo.inverse_kinematics(POSES).positions)
        expected = (room / exo.device.structure.scales).min(axis=1)
        np.testing.assert_allclose(found.margins["stroke"], expected, atol=1e-9)
        assert found.units == {"stroke": unit} == found.summary()["units"]
        (line,) = [text for text in str(found).splitlines() if text.startswith("stroke")]
        assert line.endswith(f" {unit}")
    assert ep.load("four-cables").workspace(POSES, ["stroke"]).units == {"stroke": "m"}
