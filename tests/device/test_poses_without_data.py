"""Poses that the law of a spring does not cover: a status of their own, by lengths in closed form."""

import ast
import json
import pickle
from pathlib import Path

import numpy as np
import pytest
from places import URDF
from scipy.spatial.transform import Rotation

import exo_pin as ep
import exo_pin.device
from exo_pin.device import (
    ChainDevice,
    ConstantForce,
    Drive,
    GasSpring,
    LinearSpring,
    Route,
    Spring,
    SpringLaw,
    TableLaw,
)

#: Robots with an arm on a ball joint; the others hang from elsewhere.
DEVICES = ("serial-y-x-z", "nesm", "spherical-3rrr", "3rps-passive-ball", "six-cables", "spring-support", "prototype")
#: Distances from the shoulder of the strut's ends, m, below it on the torso and on the arm.
BELOW, ON_ARM = 0.4, 0.2
WAY = Route.over(("universe", (0.0, 0.0, -BELOW)), ("arm", (0.0, 0.0, -ON_ARM)))
TABLE = TableLaw((0.285, 0.4, 0.9), (-30.0, -20.0, -10.0))
FAR = TableLaw((10.0, 11.0), (1.0, 2.0))


def length(elevation):
    """Of the strut, m, at an elevation of the arm, rad: law of cosines."""
    return np.sqrt(BELOW**2 + ON_ARM**2 - 2.0 * BELOW * ON_ARM * np.cos(elevation))


def elevation(size):
    """The other way round, degrees."""
    return np.degrees(np.arccos((BELOW**2 + ON_ARM**2 - size**2) / (2.0 * BELOW * ON_ARM)))


def support(law=TABLE, name="strut"):
    """A passive support."""
    return ep.load(URDF / "spring-support.urdf").replace(springs=[Spring(name, law, route=WAY)])


def motors(*springs):
    return ep.load(URDF / "serial-y-x-z.urdf").replace(springs=springs)


def test_the_reason_names_part_value_and_range():
    exo, angle = support(), elevation(0.25)
    poses = exo.pose([angle, 0.0, 90.0], [0.0, angle, 0.0])
    answer = exo.reaction(poses)
    assert answer.status.tolist() == ["not_evaluated", "not_evaluated", "beyond_limits"]
    reason = "spring 'strut' outside its law: 0.25 m, table 0.285 to 0.9 m"
    assert answer.reasons.tolist() == [reason, reason, ""]
    assert answer.unknown.tolist() == [True, True, False]
    assert not answer.can_hold.any()
    assert not answer.held.any()
    why = 'spring "strut" has no data at 0.25 m (table 0.285 to 0.9 m)'
    assert answer.verdict == (
        f"1 of 3 poses: cannot hold; 2: not known, because {why}. Where it cannot: the wearer's own muscles would have "
        "to add moments (1)."
    )
    single = exo.reaction(poses[0])
    assert single.verdict == f"It is not known whether the device can hold this pose: {why}."
    assert str(single.reasons) == reason
    for wrong in ("cannot be held", "can be held"):
        assert wrong not in str(single)
    (part,) = answer.source.poses.placed.lacking[0]
    assert (part.kind, part.name, part.low, part.high) == ("spring", "strut", 0.285, 0.9)
    assert part.value == pytest.approx(0.25)


def test_no_number_stands_where_data_lack_and_the_others_stay():
    """A pose's answer is the same with others in the stack; where the table holds it is that of a longer table."""
    exo = support()
    poses = exo.pose([0.0, 20.0, 60.0, 110.0], [0.0, 10.0, 0.0, 30.0])
    answer, whole = exo.reaction(poses), support(ConstantForce(0.0)).reaction(poses)
    lost = answer.status == "not_evaluated"
    assert lost.tolist() == [True, True, False, False]
    for name in ("shoulder_force", "actuator_forces", "limb_wrenches", "cuff_wrench", "harness_wrenches", "residual"):
        values = getattr(answer, name).reshape(4, -1)
        assert np.isnan(values[lost]).all(), name
        assert np.isfinite(values[~lost]).all(), name
    alone = [exo.reaction(poses[k]).shoulder_force for k in (2, 3)]
    np.testing.assert_array_equal(answer.shoulder_force[~lost], alone)
    # By hand: the strut's force on the arm, and its moment about the shoulder.
    for k in (2, 3):
        at, start = poses[k].apply([0.0, 0.0, -ON_ARM]), np.array([0.0, 0.0, -BELOW])
        size = np.linalg.norm(at - start)
        push = TABLE.force(size) * (start - at) / size
        np.testing.assert_allclose(whole.shoulder_force[k] - answer.shoulder_force[k], push, atol=1e-9)
        np.testing.assert_allclose(whole.actuator_forces[k] - answer.actuator_forces[k], np.cross(at, push), atol=1e-9)


def test_tables_and_files_have_the_reason(tmp_path):
    exo = support()
    answer = exo.reaction(exo.pose([10.0, 90.0]))
    assert answer.as_dict()["reasons"].tolist() == answer.reasons.tolist()
    assert json.loads(answer.to_json())["reasons"] == answer.reasons.tolist()
    table = answer.columns()
    assert table["verdict"].tolist() == ["not known", "not held"]
    assert table["reason"][0] == answer.reasons[0]
    assert table["reason"][1].startswith("the wearer's own muscles would have to add")
    assert "not evaluated" in str(answer)
    again = pickle.loads(pickle.dumps(answer))
    assert again.reasons.tolist() == answer.reasons.tolist()
    seen = exo.reaction(exo.pose([90.0, 100.0]))
    assert seen.reasons.tolist() == ["", ""]
    assert ep.load("prototype").reaction(ep.load("prototype").pose([10, 20])).reasons.tolist() == ["", ""]
    unasked = exo.reaction(exo.pose([10.0, 90.0]), limits="none").verdict
    assert unasked.endswith('1 have no result, because spring "strut" has no data at 0.206 m (table 0.285 to 0.9 m).')


def same_kinematics(one, other, poses):
    """Jacobian, kind and mobility of two devices."""
    np.testing.assert_array_equal(one.jacobian(poses), other.jacobian(poses))
    places = [exo.inverse_kinematics(poses).positions for exo in (one, other)]
    np.testing.assert_array_equal(*places)
    first, second = one.singularity(poses), other.singularity(poses)
    for name, values in vars(first).items():
        np.testing.assert_array_equal(values, getattr(second, name), err_msg=name)
    assert one.device.structure == other.device.structure
    assert one.device.limb_count == other.device.limb_count
    q = one.configurations(poses)
    for row in q[np.isfinite(q).all(axis=1)][:2]:
        assert one.chain.mobility(row).degrees_of_freedom == other.chain.mobility(row).degrees_of_freedom


@pytest.mark.parametrize("name", DEVICES)
def test_a_passive_part_changes_no_kinematics(name):
    """Springs without data in any pose, along a route and in a joint, a cuff, and another arm."""
    exo = ep.load(URDF / f"{name}.urdf")
    if name == "prototype":
        exo = ep.ShoulderExo.from_chain(exo.chain)
    rng = np.random.default_rng(5)
    poses = exo.pose(*rng.uniform([0.0, 0.0, -20.0], [100.0, 80.0, 40.0], (4, 3)).T)
    joints = [str(joint) for joint in list(exo.chain.model.names)[1:] if exo.chain.velocity_indices([joint]).size == 1]
    springs = [Spring("far", FAR, route=WAY), *(Spring("twist", FAR, joint=joint) for joint in joints[:1])]
    cuff = ep.Interfaces(cuff=ep.Interface.upper_arm_cuff(distance=0.19))
    for changed in (
        exo.replace(springs=springs),
        exo.replace(interfaces=cuff),
        exo.worn_by(ep.Person(1.6, 60, "female")),
    ):
        same_kinematics(exo, changed, poses)
    answer = exo.replace(springs=springs).worn_by(ep.Person(1.6, 60, "female")).reaction(poses)
    reached = answer.status != "out_of_reach"
    assert reached.any()
    assert (answer.status[reached] == "not_evaluated").all()
    assert all(f"spring '{spring.name}'" in text for spring in springs for text in answer.reasons[reached])


@pytest.mark.parametrize("seed", range(6))
def test_a_passive_part_changes_no_kinematics_of_random_cables(seed):
    rng = np.random.default_rng(seed)
    chain = ep.load(URDF / "spring-support.urdf").chain

    def way(via):
        points = [
            ("universe", rng.uniform(-0.3, 0.3, 3)),
            *(("arm", rng.uniform(-0.2, 0.0, 3)) for _ in range(1 + via)),
        ]
        return Route.over(*points)

    drives = [Drive(f"cable_{k}", route=way(rng.integers(0, 2))) for k in range(rng.integers(2, 6))]
    exo = ep.ShoulderExo.from_chain(chain).replace(drives=drives)
    springs = [Spring(f"spring_{k}", FAR, route=way(0)) for k in range(2)]
    poses = exo.pose(*rng.uniform(0.0, 90.0, (3, 3)).T)
    same_kinematics(exo, exo.replace(springs=springs), poses)


def test_laws_say_what_they_cover():
    assert TABLE.range == (0.285, 0.9)
    assert ConstantForce(3.0).range == LinearSpring(20.0).range == (-np.inf, np.inf)
    low, high = GasSpring(100.0, extended_length=0.3, gas_height=0.2).range
    assert low == pytest.approx(0.1)
    assert np.isposinf(high)
    assert np.isfinite(GasSpring(100.0, extended_length=0.3, gas_height=0.2).force(low))


def test_the_ends_of_a_table_are_covered():
    """Also where rounding puts the length beside them, and no further."""
    exo, steps = support(TableLaw((0.285, 0.4, 0.5), (-30.0, -20.0, -10.0))), np.array([0.0, 1e-9, -1e-9])
    for end, out in ((0.285, -1.0), (0.5, 1.0)):
        assert exo.reaction(exo.pose(elevation(end) + steps)).reasons.tolist() == [""] * 3
        assert exo.reaction(exo.pose(elevation(end) + out * 1e-4)).status == "not_evaluated"


def test_a_gas_spring_needs_gas():
    exo = support(GasSpring(100.0, extended_length=0.6, gas_height=0.3), name="gas")
    short, long = exo.reaction(exo.pose(elevation(0.25))), exo.reaction(exo.pose(elevation(0.35)))
    assert str(short.reasons) == "spring 'gas' outside its law: 0.25 m, gas column from 0.3 m"
    assert long.reasons == ""


def test_a_law_of_ones_own_says_where_it_ends():
    class Short(SpringLaw):
        """Known up to 0.4 m."""

        range = (0.0, 0.4)

        def force(self, x):
            return 10.0 + 0.0 * np.asarray(x)

        def energy(self, x):
            return 10.0 * np.asarray(x)

    class Silent(Short):
        """Says it by NaN."""

        range = (-np.inf, np.inf)

        def force(self, x):
            return np.where(np.asarray(x) < 0.4, 10.0, np.nan)

    class Broken(Short):
        """Fails by a mistake of its own, which nobody else may hide."""

        def force(self, x):
            raise ep.InvalidInput("a mistake of this law")

    angles = [elevation(0.3), elevation(0.5)]
    for law, words in ((Short(), ", law 0 to 0.4 m"), (Silent(), "")):
        answer = support(law).reaction(support().pose(angles))
        assert answer.reasons.tolist() == ["", f"spring 'strut' outside its law: 0.5 m{words}"]
    with pytest.raises(ep.InvalidInput, match="a mistake of this law"):
        support(Broken()).reaction(support().pose(angles[:1]))


def test_angles_are_said_in_degrees():
    hinge = Spring("twist", TableLaw((0.0, np.radians(60.0)), (0.0, 5.0)), joint="flexion")
    exo = motors(hinge)
    answer = exo.reaction(exo.pose([30.0, 80.0]))
    assert answer.reasons.tolist() == ["", "spring 'twist' outside its law: 80°, table 0 to 60°"]
    other = exo.replace(springs=[hinge, Spring("strut", FAR, route=WAY)]).reaction(exo.pose(80.0))
    assert 'spring "twist" has no data at 80° (table 0 to 60°) and spring "strut" has no data at' in other.verdict
    assert (
        other.reasons
        == f"{answer.reasons[1]}; spring 'strut' outside its law: {length(np.radians(80.0)):.3g} m, table 10 to 11 m"
    )


def test_a_value_just_outside_is_not_shown_as_the_end():
    exo = support()
    assert str(exo.reaction(exo.pose(elevation(0.28496))).reasons).endswith("0.28496 m, table 0.285 to 0.9 m")


@pytest.mark.full
def test_a_pose_without_data_has_a_remedy_elsewhere():
    """The nearest pose that is held, and not the pose itself."""
    exo = motors(Spring("strut", TABLE, route=WAY))
    pose = exo.pose(30.0)
    assert exo.reaction(pose).status == "not_evaluated"
    remedy = exo.remedy(pose)
    assert remedy.nearest.distance > 0.05
    assert "itself can be held" not in str(remedy)
    assert exo.reaction(remedy.nearest.pose).held


def test_a_route_whose_points_coincide_has_no_direction():
    """Of a drive the Jacobian is not known there, of a spring its force; the poses beside it are."""
    way = Route.over(("universe", (0.0, 0.0, -0.2)), ("arm", (0.0, 0.0, -0.2)))
    exo = ep.load(URDF / "spring-support.urdf")
    poses = exo.pose([0.0, 30.0])
    pulled = exo.replace(springs=[Spring("cord", ConstantForce(5.0), route=way)]).reaction(poses)
    words = "without a direction: two points of its route coincide"
    assert pulled.reasons.tolist() == [f"spring 'cord' {words}", ""]
    # A spring that is slack where its ends meet needs none.
    assert exo.replace(springs=[Spring("cord", LinearSpring(50.0), route=way)]).reaction(poses).reasons.tolist() == [
        "",
        "",
    ]
    driven = exo.replace(drives=[Drive("cable", route=way)], springs=())
    assert driven.reaction(poses).reasons.tolist() == [f"drive 'cable' {words}", ""]
    assert driven.singularity(poses).kind.tolist() == ["not_evaluated", "passive"]
    J = driven.jacobian(poses)
    assert np.isnan(J[0]).all()
    assert np.isfinite(J[1]).all()
    assert np.isnan(driven.singularity(poses).margin).tolist() == [True, False]


def test_with_a_soft_cuff_the_way_ends_where_the_data_do():
    cuff = ep.Interfaces(cuff=ep.Interface.upper_arm_cuff(distance=0.19))
    exo = motors(Spring("strut", TABLE, route=WAY)).replace(interfaces=cuff)
    longer = exo.replace(
        springs=[Spring("strut", TableLaw((0.05, *TABLE.coordinates), (-40.0, *TABLE.forces)), route=WAY)]
    )
    poses = exo.pose([20.0, 70.0, 90.0])
    answer, other = exo.reaction(poses, split="elastic"), longer.reaction(poses, split="elastic")
    assert answer.status.tolist() == ["not_evaluated", "ok", "ok"]
    assert answer.reasons[0].startswith("spring 'strut' outside its law: 0.2")
    assert np.isnan(answer.shoulder_force[0]).all()
    # Away from its first pieces the curve through the points is the same.
    assert other.status.tolist() == ["ok"] * 3
    np.testing.assert_allclose(answer.shoulder_force[2], other.shoulder_force[2], rtol=1e-9)


def test_who_wears_it_is_told_what_is_not_known():
    man = ep.Person(1.75, 75, "male")
    exo = motors(Spring("strut", TABLE, route=WAY))
    poses = exo.pose([10.0, 80.0])
    for forces in (None, 0.5, "least_effort", np.zeros(3)):
        found = exo.joint_contact(poses, man, forces)
        assert found.status.tolist() == ["no_device_force", "ok"]
        assert "not known: spring 'strut' outside its law: 0.206 m" in found.verdict


@pytest.mark.full
def test_an_uncertainty_at_the_end_of_data_is_no_pose_without_equilibrium():
    """10 mm of offset lead out of the table: that is missing data, and not a force without bound."""
    exo = motors(Spring("strut", TABLE, route=WAY)).worn_by(ep.Person(1.75, 75, "male"))
    exo = exo.replace(interfaces=ep.Interfaces(cuff=ep.Interface.upper_arm_cuff(distance=0.19)))
    pose = exo.pose(elevation(0.285) + 0.5)
    with pytest.raises(ep.MissingData, match=r"spring 'strut' outside its law: 0\.28"):
        exo.uncertainty(pose, split="elastic", uncertainties={"offset_mm": 10})


def test_a_map_marks_them_too():
    exo = support()
    found = exo.reaction_map(exo.pose([10.0, 90.0]))
    assert found.status.tolist() == ["not_evaluated", "beyond_limits"]
    assert found.unknown.tolist() == [True, False]
    assert np.isnan(found.magnitude).tolist() == [True, False]


def test_a_movement_does_not_count_them_as_lost():
    exo, times = motors(Spring("strut", TABLE, route=WAY)), np.linspace(0.0, 2.0, 9)
    found = exo.follow(ep.Movement.from_samples(times, exo.pose(np.linspace(0.0, 90.0, 9)), smoothing=None))
    assert 0.2 < (found.reaction.status == "not_evaluated").mean() < 0.8
    assert found.fraction_not_holdable == 0.0
    assert np.isfinite(found.peak)


def test_nothing_in_the_device_swallows_every_error():
    """Handlers name the one thing that they expect."""
    for path in Path(exo_pin.device.__file__).parent.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ExceptHandler) and not isinstance(node.body[-1], ast.Raise):
                caught = {each.id for each in ast.walk(node.type) if isinstance(each, ast.Name)}
                assert not caught & {"ExoPinError", "Exception", "BaseException"}, path.name


def test_a_device_is_asked_with_data_of_few_poses_alone():
    """Published from 10 to 100°: structure and drives are found without the poses between which it is not known."""
    law = TableLaw((length(np.radians(10.0)), length(np.radians(100.0))), (-4.0, -40.0))
    device = ChainDevice.from_chain(ep.load(URDF / "spring-support.urdf").chain).replace(
        springs=[Spring("s", law, route=WAY)]
    )
    assert (device.structure.moments, device.limb_count) == (0, 3)
    answer = ep.solve(device, ep.Case(Rotation.from_rotvec([[0.0, -np.radians(a), 0.0] for a in (5.0, 50.0, 105.0)])))
    assert answer.status.tolist() == ["not_evaluated", "beyond_limits", "not_evaluated"]
