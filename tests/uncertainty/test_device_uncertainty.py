"""How sure the shoulder's force of a device that is not a wrist is: each number is an answer to a changed question."""

import numpy as np
import pytest
from places import URDF
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import device

MAN = ep.Wearer(1.755, 85.0, "male")
ONLY = {"offset_mm": 0.0, "pose_deg": 0.0, "mass_percent": 0.0, "centre_of_mass_mm": 0.0}


@pytest.fixture(scope="module")
def serial():
    return ep.load(URDF / "serial-y-x-z.urdf").worn_by(MAN)


def effect(found, name):
    return next(effect for effect in found.effects if effect.name == name)


@pytest.mark.parametrize("name", ["spring-support", pytest.param("3rps-passive-ball", marks=pytest.mark.full)])
def test_ten_millimetres_in_every_direction(name):
    """The worst of all directions is no less than any that is drawn, and each number is the answer of that offset."""
    exo = ep.load(URDF / f"{name}.urdf").worn_by(MAN)
    others = {"spring_mm": 0.0} if name == "spring-support" else {"joint_mm": 0.0, "end_b_mm": 0.0}
    pose = exo.pose(30, 45, 30)
    found = exo.uncertainty(pose, limits="none", uncertainties=ONLY | others | {"offset_mm": 10.0})
    worst = found.worst_offset
    rng = np.random.default_rng(5)
    drawn = rng.normal(size=(10, 3))
    drawn *= 0.01 / np.linalg.norm(drawn, axis=1, keepdims=True)
    offsets = np.concatenate([drawn, 0.01 * worst.directions[[4, 9, 22]], [worst.offset]])
    sizes = exo.reaction(Rotation.concatenate([pose] * 14), limits="none", centre_offset=offsets).magnitude
    assert sizes[:10].max() <= worst.magnitude * (1 + 1e-6)
    np.testing.assert_allclose(sizes[10:], [*worst.magnitudes[[4, 9, 22]], worst.magnitude], rtol=1e-9)
    assert np.linalg.norm(worst.offset) == pytest.approx(0.01)
    # Some of the 26 directions is less than 28° from the worst, and the change of |F_s| goes with the cosine.
    assert worst.magnitude - worst.magnitudes.max() < 0.15 * (worst.magnitude - found.magnitude)
    assert "Worst offset within 10 mm: (" in str(found)
    table = str(found).split("mm off (in the middle")[1]
    # The columns lie forward, in the middle and backward.
    for place, row, column in [((1, 1, 1), "up left", 0), ((0, -1, -1), "down right", 1), ((-1, 0, 1), "up", 2)]:
        size = worst.magnitudes[(worst.directions @ place).argmax()]
        cells = next(line.removeprefix(f"  {row} ") for line in table.splitlines() if line.startswith(f"  {row:<12}"))
        assert cells.split()[column] == f"{size:.1f}"


@pytest.mark.full
def test_devices_that_hold_the_centre_fight_the_same_cuff_alike():
    """Their links are rigid and their centre is one: only the cuff gives way, whatever the device is."""
    cuff, tables = ep.Interface.upper_arm_cuff(0.19), []
    for name in ("serial-y-x-z", "nesm", "spherical-3rrr"):
        exo = ep.load(URDF / f"{name}.urdf").worn_by(MAN).replace(interfaces=ep.Interfaces(cuff=cuff))
        asked = ONLY | {"offset_mm": 10.0, "springs_percent": 0.0}
        found = exo.uncertainty(exo.pose(30, 45, 30), split="elastic", limits="none", uncertainties=asked)
        tables.append([found.magnitude, *found.worst_offset.magnitudes])
    np.testing.assert_allclose(tables[1:], [tables[0]] * 2, rtol=1e-6)
    assert max(tables[0]) > 1.5 * tables[0][0]


def test_the_foot_of_a_strut_moves_its_force():
    support = ep.load(URDF / "spring-support.urdf").worn_by(MAN)
    pose = support.pose(0, 60)
    found = support.uncertainty(pose, uncertainties=ONLY | {"spring_mm": 0.0, "spring[strut,1]_mm": 3.0})
    strut = support.device.springs[0]
    sizes = []
    for step in 3e-3 * np.concatenate([np.eye(3), -np.eye(3)]):
        first, *rest = strut.route.points
        moved = device.RoutePoint(first.link, tuple(np.add(first.point, step)))
        route = device.Route((moved, *rest))
        other = support.replace(springs=[device.Spring(strut.name, strut.law, route=route)])
        sizes.append(float(other.reaction(pose).magnitude))
    own = effect(found, "spring[strut,1]_mm")
    assert not any("count as certain" in text for text in found.cautions)
    # The steepest direction is tried besides.
    assert own.least <= min(sizes) + 1e-12
    assert own.greatest >= max(sizes) - 1e-12
    assert own.change(found.magnitude) < 1.1 * max(abs(size - found.magnitude) for size in sizes) * 3**0.5
    assert found.provenance["design"]["sha256"] == support.device.hash


@pytest.mark.parametrize("shift", [0.015, -0.015, 0.01])
def test_a_misaligned_device_that_locks_the_arm_has_no_forces_made_of_rounding(shift):
    """Shifted along the first axis it follows turns about that axis alone: two drives then work against the loops."""
    exo = ep.load(URDF / "serial-y-x-z.urdf").worn_by(MAN)
    answer = exo.reaction(exo.pose(60), centre_offset=(0.0, shift, 0.0))
    assert answer.status == "singular"
    assert np.isnan(answer.shoulder_force).all()
    assert not answer.can_hold
    assert "block rotations of the arm" in answer.verdict
    assert exo.reaction(exo.pose(60)).status == "ok"


@pytest.mark.full
def test_a_wrist_without_its_closed_forms_is_as_sure():
    """The same names and numbers; least and largest over the offsets are those of a search that is finer."""
    exo = ep.load("four-cables")
    pose = exo.pose(30, 30)
    whole = exo.uncertainty(pose)
    alone = ep.ShoulderExo.from_device(exo.device.as_chain()).uncertainty(pose)
    assert [own.name for own in alone.effects] == [own.name for own in whole.effects]
    for one, other in zip(whole.effects, alone.effects, strict=True):
        np.testing.assert_allclose([other.least, other.greatest], [one.least, one.greatest], rtol=1e-6)
    drawn = np.random.default_rng(8).normal(size=(20_000, 3))
    drawn *= 0.015 / np.linalg.norm(drawn, axis=1, keepdims=True)
    sizes = exo.reaction_map(Rotation.concatenate([pose] * len(drawn)), centre_offset=drawn).magnitude
    found = effect(whole, "offset_mm")
    assert found.least <= sizes.min() < found.least * 1.001
    assert found.greatest * 0.999 < sizes.max() <= found.greatest


def test_two_hinges_keep_an_arm_whose_pose_is_not_certain_on_their_own_poses():
    """A turn about the arm itself, which they cannot follow, changes nothing of three hinges either."""
    three = ep.load(URDF / "serial-y-x-z.urdf")
    chain = three.device.chain
    held = chain.locked(["internal_rotation"], chain.reference_configuration())
    two, three = ep.ShoulderExo.from_device(ep.device.ChainDevice.from_chain(held)).worn_by(MAN), three.worn_by(MAN)
    stated = {"offset_mm": 0.0, "mass_percent": 0.0, "centre_of_mass_mm": 0.0, "pose_deg": 3.0}
    ends = []
    for exo in (two, three):
        (effect,) = exo.uncertainty(exo.pose(40, 10), uncertainties=stated).effects
        assert effect.holds
        ends.append((effect.least, effect.greatest))
    np.testing.assert_allclose(*ends, rtol=1e-3)
    words = str(two.uncertainty(two.pose(40, 10), uncertainties=stated | {"offset_mm": 10.0, "pose_deg": 0.0}))
    assert "no answer, not held throughout  with offset_mm" in words
    assert "The device has no answer" in words
    assert ": rigid, it cannot follow" in words
    with pytest.raises(ep.SolverFailed, match=r"no draw has an answer, not of offset_mm alone either"):
        two.total_uncertainty(two.pose(40, 10), draws=8)
