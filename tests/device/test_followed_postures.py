"""A device follows its arm on the assembly mode from rest, as closed forms and many small steps do."""

from dataclasses import replace

import numpy as np
import pytest
from limb_devices import in_small_steps, limb_device
from places import URDF
from scipy.spatial.transform import Rotation
from two_bar_devices import TwoBar

import exo_pin as ep
from exo_pin import Criteria


def about_y(turns):
    return Rotation.from_rotvec(np.asarray(turns)[..., None] * [0.0, 1.0, 0.0])


def apart(one, other):
    """Differences of angles, rad."""
    return np.abs(np.remainder(one - other + np.pi, 2.0 * np.pi) - np.pi)


@pytest.mark.parametrize("degrees", [0.5, 2.0, 3.0, 5.0, 8.0, 12.0, 20.0])
def test_a_two_bar_linkage_keeps_its_mode_past_straight(degrees):
    rng = np.random.default_rng(3)
    for _ in range(4):
        linkage, straightest = TwoBar.passing_straight(np.deg2rad(degrees), rng)
        turns = straightest * np.linspace(0.05, 1.9, 24)
        q = ep.ShoulderExo.from_device(linkage.device).configurations(about_y(turns))
        found = q[:, linkage.chain.configuration_slice("elbow")]
        # A hinge without limits is a cosine and a sine.
        angle = np.arctan2(found[:, 1], found[:, 0])
        assert apart(angle, linkage.hinge(turns)).max() < 1e-8


@pytest.mark.parametrize("degrees", [2.0, 5.0, 10.0, 20.0])
def test_a_two_bar_linkage_ends_at_a_gap_and_not_behind_it(degrees):
    rng = np.random.default_rng(4)
    linkage, straightest = TwoBar.passing_straight(np.deg2rad(degrees), rng)
    short = TwoBar(linkage.point, linkage.base, tuple(0.97 * bar for bar in linkage.bars), linkage.side)
    turns = straightest * np.linspace(0.05, 1.95, 40)
    closes = np.array([short.closes_on_the_way(turn) for turn in turns])
    behind = np.isfinite(short.elbow(turns)) & ~closes
    assert closes.any()
    assert behind.any()
    exo = ep.ShoulderExo.from_chain(short.chain)
    answer = exo.reaction(about_y(turns), limits="none")
    np.testing.assert_array_equal(answer.status == "out_of_reach", ~closes)
    # The end of the way is the straight linkage: the margin is the share that was followed less one, and its limit.
    criteria = Criteria(["connected"])
    margin = exo.workspace(about_y(turns[:, None, None]), criteria).margins["connected"].ravel()
    np.testing.assert_array_equal(margin > 0.0, closes)
    edge = (1.0 + margin[~closes] + criteria.least_margin) * turns[~closes]
    assert np.ptp(edge) < 1e-4
    assert abs(short._cosine(edge[0])) == pytest.approx(1.0, abs=1e-4)


@pytest.mark.parametrize("seed", [9, 28, 156])
def test_random_limbs_keep_their_modes(seed):
    rng = np.random.default_rng(seed)
    device = limb_device(rng, limbs=int(rng.integers(1, 3)))
    turns = rng.normal(size=(6, 3))
    turns *= (rng.uniform(0.2, 1.6, 6) / np.linalg.norm(turns, axis=1))[:, None]
    exo = ep.ShoulderExo.from_device(device)
    q, rest = exo.configurations(Rotation.from_rotvec(turns)), exo.configurations(Rotation.identity())
    compared = 0
    for found, turn in zip(q, turns, strict=True):
        exact, margin = in_small_steps(device.chain, rest, turn, 1e-3)
        if margin < 1e-3:
            continue
        compared += 1
        if exact is None:
            assert np.isnan(found).all()
        else:
            np.testing.assert_allclose(found[4:], exact[4:], atol=1e-8)
    assert compared >= 3


def test_modes_of_a_linkage_beside_that_from_rest():
    linkage, straightest = TwoBar.passing_straight(np.deg2rad(10.0), np.random.default_rng(0))
    modes = ep.ShoulderExo.from_device(linkage.device).assembly_modes(about_y(0.5 * straightest), 20, 0)
    own = linkage.chain.configuration_slice("elbow")
    angle = np.arctan2(modes[:, own][:, 1], modes[:, own][:, 0])
    rest, here = linkage.elbow_at_rest, float(linkage.elbow(0.5 * straightest))
    assert len(modes) == 2
    assert apart(angle, np.array([rest - here, rest + here])).max() < 1e-8


TWO_HINGES = """<mujoco><compiler angle="radian"/><worldbody>
  <body name="arm"><joint name="shoulder" type="ball"/>
    <inertial pos="0 0 -.2" mass="2" diaginertia=".03 .03 .005"/><site name="own"/></body>
  <body name="first"><joint name="flexion" axis="0 1 0"/><inertial pos="0 .1 0" mass=".3" diaginertia="1 1 1"/>
    <body name="second"><joint name="abduction" axis="1 0 0"/><inertial pos="0 0 0" mass=".3" diaginertia="1 1 1"/>
      <site name="there"/>{more}</body></body>
  </worldbody><equality><weld site1="own" site2="there"/></equality>
  <actuator><motor joint="flexion"/><motor joint="abduction"/>{drive}</actuator></mujoco>"""
SLIDE = (
    '<body name="load"><joint name="slide" type="slide"/><inertial pos="0 0 0" mass=".1" diaginertia="1 1 1"/></body>'
)


@pytest.mark.parametrize("idle", [False, True])
def test_a_pose_that_loops_do_not_let_the_arm_turn_to_is_out_of_reach(idle):
    more = {"more": SLIDE, "drive": '<motor joint="slide"/>'} if idle else {"more": "", "drive": ""}
    chain = ep.ClosedChain.from_mjcf(TWO_HINGES.format(**more))
    roles = ep.chain.Roles(chain.roles.actuated, "shoulder", "arm")
    exo = ep.ShoulderExo.from_chain(ep.ClosedChain(chain.model, replace(chain.description, roles=roles)))
    answer = exo.reaction(exo.pose([20, 0, 0, 20], [0, 20, 0, 0], [0, 0, 10, 1]), limits="none")
    assert answer.status.tolist() == ["ok", "ok", "out_of_reach", "out_of_reach"]
    assert np.isnan(exo.configurations(answer.case.poses[2:])).all()
    verdict = exo.reaction(exo.pose(0, 0, 10), limits="none").verdict
    assert verdict.endswith("the device does not reach it. From rest it cannot turn the arm this way.")
    # Both hinges reach it one after the other; the weight of the arm has its moment about each.
    pose = exo.pose(20, 20)
    held = exo.reaction(pose, limits="none", posture=exo.assembly_modes(pose, starts=4)[0])
    assert held.status == "ok"
    moment = 2.0 * 9.81 * 0.2 * np.sin(np.radians(20.0)) * np.cos(np.radians(20.0))
    np.testing.assert_allclose(held.actuator_forces[:2], [-moment, moment], rtol=1e-6)


def test_two_hinges_go_their_own_way_where_they_cannot_turn_straight():
    """As with a third hinge that stands still; a pose that needs it is out of reach."""
    three = ep.load(URDF / "serial-y-x-z.urdf")
    chain = three.device.chain
    held = chain.locked(["internal_rotation"], chain.reference_configuration())
    two = ep.ShoulderExo.from_device(ep.device.ChainDevice.from_chain(held))
    poses = two.pose([40.0, 60.0, 90.0, 20.0, 40.0], [10.0, 45.0, 45.0, -20.0, 10.0], [0.0, 0.0, 0.0, 0.0, 20.0])
    found, other = (exo.reaction(poses, limits="none") for exo in (two, three))
    assert found.status.tolist() == ["ok"] * 4 + ["out_of_reach"]
    np.testing.assert_allclose(found.shoulder_force[:4], other.shoulder_force[:4], atol=1e-9)
    # The same on the other side, and of a file whose digits leave the geometry open.
    right, rounded = (
        two.mirrored(),
        ep.ShoulderExo.from_device(ep.device.ChainDevice.from_chain(held.with_tolerance(1e-5))),
    )
    turned = right.pose([40.0, 60.0, 90.0, 20.0], [10.0, 45.0, 45.0, -20.0])
    mirrored = right.reaction(turned, limits="none").shoulder_force * [1.0, -1.0, 1.0]
    np.testing.assert_allclose(mirrored, found.shoulder_force[:4], atol=1e-9)
    again = rounded.reaction(poses[:4], limits="none").shoulder_force
    np.testing.assert_allclose(again, found.shoulder_force[:4], atol=1e-6)
    alone = [two.configurations(pose) for pose in poses[:4]]
    np.testing.assert_array_equal(two.configurations(poses[:4]), alone)
    nearest = two.remedy(poses[4]).nearest
    turned = two.pose(np.arange(35.0, 46.0)[:, None], np.arange(5.0, 16.0), 0.0)
    assert nearest.distance == pytest.approx((turned * poses[4].inv()).magnitude().min(), abs=1e-9)
    still = two.reaction(poses[0], ep.Motion([0.0, 0.0, 1.0], [0.0, 0.0, 0.0]), limits="none")
    assert still.verdict.endswith("the device cannot make this motion.")
    assert two.track("flexion", duration=0.1).cautions == three.track("flexion", duration=0.1).cautions


def test_three_hinges_of_which_two_are_alike_at_rest_have_no_way_of_their_own(tmp_path):
    text = (URDF / "serial-y-x-z.urdf").read_text(encoding="utf-8")
    first, innermost, rest = text.partition('name="internal_rotation"')
    (tmp_path / "r.urdf").write_text(
        first + innermost + rest.replace('axis xyz="0.0 0.0 1.0"', 'axis xyz="0.0 1.0 0.0"', 1), encoding="utf-8"
    )
    (tmp_path / "r.closures.toml").write_bytes((URDF / "serial-y-x-z.closures.toml").read_bytes())
    exo = ep.load(tmp_path / "r.urdf")
    assert exo.reaction(exo.pose(30.0, 20.0)).status == "beyond_singular"
