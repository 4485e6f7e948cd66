"""Tables of limbs and of tasks, whose numbers are known: lengths, forces, gaps, rates and what limits a task."""

import pickle
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import exo_pin as ep
from exo_pin import InvalidInput
from exo_pin.device import ChainDevice, Drive
from exo_pin.load_case import RangeOfMotion
from exo_pin.numerics.cones import fork_tilt
from exo_pin.study import StudyTable
from exo_pin.workspace import CRITERIA, Criteria, Criterion, limb_loss, limb_sheet, limb_table, task_reach
from exo_pin.workspace import query as tasks
from exo_pin.wrist import clearances

pytestmark = pytest.mark.usefixtures("plain")

NAN = np.nan
LINEAR = ep.Actuator("linear", pull_limit=300.0, push_limit=250.0)


def three(actuator=LINEAR, mass=2.0, **limb):
    """Three limbs in planes across one another."""
    base = [[0.0, 0.1, 0.3], [0.3, 0.0, 0.1], [0.1, 0.3, 0.0]]
    platform = [[0.0, 0.1, -0.2], [-0.2, 0.0, 0.1], [0.1, -0.2, 0.0]]
    arm = ep.Arm(mass, [0.0, 0.0, -0.25], np.diag([0.1, 0.1, 0.01]))
    each = ep.Limb("SPS", actuator=actuator, **limb)
    return ep.ShoulderExo(ep.WristGeometry(base, platform), arm=arm, limbs=[each] * 3, name="three")


def small_grid(exo):
    return exo.pose(*np.meshgrid([0.0, 15.0, 25.0], [0.0, 12.0], [0.0, 10.0], indexing="ij"))


BODY = ep.BodyShape([[0.3, -0.4, -0.3, 0.3, -0.4, 0.3, 0.05]], [[0.0, 0.0, 0.0, 0.0, 0.0, -0.1, 0.04]])


def test_limbs_over_a_grid_of_poses():
    """Each over the poses that are inside; each has the gaps of its own and stands in the row of its number."""
    exo = three(stroke=ep.Stroke(0.5, 0.8, 1.0, 0.05))
    limits = Criteria(names=("singularity", "forces", "clearance"), body=BODY, limb_radius=0.01, least_gap=-1.0)
    load = ep.Load([0.0, 0.0, 0.0], moment=[1.0, -0.5, 0.8])
    found = exo.workspace(small_grid(exo), limits.replace(least_moment=20.0), load=load)
    assert 0 < found.inside.sum() < found.inside.size == 12
    table = limb_table(exo.mechanism, found)
    assert table["limb"].tolist() == [1, 2, 3]
    inside = found.inside
    for columns, values in (
        (("used_from_m", "used_to_m"), found.lengths[inside]),
        (("force_from_N", "force_to_N"), found.tensions[inside]),
    ):
        np.testing.assert_array_equal(table[columns[0]], values.min(axis=0))
        np.testing.assert_array_equal(table[columns[1]], values.max(axis=0))
        assert (values.max(axis=0) > values.min(axis=0)).all()
    np.testing.assert_allclose(table["stroke_from_m"], 0.45)
    np.testing.assert_allclose(table["stroke_to_m"], 0.55)
    R = np.ascontiguousarray(found.poses.as_matrix()[inside])
    for k, (a, b) in enumerate(zip(exo.geometry.base_points, exo.geometry.platform_points, strict=True)):
        seen = (b - a @ R) / np.linalg.norm(b - a @ R, axis=1)[:, None]
        assert table["arm_tilt_deg"][k] == pytest.approx(np.degrees(fork_tilt(seen)[1]), rel=1e-6)
        assert table["arm_tilt_deg"][k] > 0.1

    def least(*limbs):
        """Gaps of some limbs alone."""
        joints = exo.geometry.base_points[list(limbs)], exo.geometry.platform_points[list(limbs)]
        return clearances(R, *joints, np.full(len(limbs), 0.01), BODY).min(axis=0)

    gaps = np.array([least(k) for k in range(3)])
    gaps[:, 2] = [min(least(k, other)[2] for other in {0, 1, 2} - {k}) for k in range(3)]
    for k, name in enumerate(("arm", "torso", "limbs")):
        np.testing.assert_allclose(table[f"gap_{name}_m"], gaps[:, k])
        assert np.min(table[f"gap_{name}_m"]) == pytest.approx(found.gaps[inside][:, k].min())
    assert len({round(float(gap), 6) for gap in gaps[:, :2].ravel()}) > 3
    # Without a body, or with a limb of no known radius, there are none.
    bodiless = exo.workspace(small_grid(exo), ["singularity"])
    assert (bodiless.gaps.shape, bodiless.tensions.shape) == ((3, 2, 2, 3), (3, 2, 2, 3))
    assert bodiless.shoulder_force.shape == (3, 2, 2, 3)
    bare = limb_table(exo.mechanism, bodiless)
    for name in ("arm", "torso", "limbs"):
        assert np.isnan(bare[f"gap_{name}_m"]).tolist() == [True] * 3
    thin = exo.replace(limbs=[*exo.limbs[:2], ep.Limb("SPS")])
    some = thin.workspace(small_grid(exo), Criteria(names=("singularity",), body=BODY))
    assert np.isnan(limb_table(thin.mechanism, some)["gap_arm_m"]).all()


def test_no_table_of_another_number_of_limbs_whatever_the_stack():
    exo, four = three(), ep.load("four-cables")
    with pytest.raises(InvalidInput, match="workspace of 4 limbs, got one of 3"):
        limb_table(four.mechanism, exo.workspace(small_grid(exo), ["singularity"]))
    none = exo.workspace(small_grid(exo), Criteria(names=("shoulder_force",), largest_shoulder_force=0.1))
    with pytest.raises(InvalidInput, match="poses inside"):
        limb_table(exo.mechanism, none)
    assert limb_table(exo.mechanism, exo.workspace(exo.pose(), ["singularity"]))["limb"].tolist() == [1, 2, 3]


def test_sheet_of_the_workshop_line_by_line():
    exo = three()
    rows = [
        {
            "limb": k + 1, "stroke_from_m": NAN if k else 0.4501, "stroke_to_m": NAN if k else 0.5499,
            "used_from_m": 0.46 + 0.01 * k, "used_to_m": 0.52 + 0.01 * k, "force_from_N": -12.4 + k,
            "force_to_N": 100.4 + k, "gap_arm_m": 0.01 + k / 1e3, "gap_torso_m": NAN, "gap_limbs_m": 0.03 + k / 1e3,
            "base_cone_deg": 20.0 + k, "arm_cone_deg": 30.0 + k, "arm_tilt_deg": 5.4 + k,
        }
        for k in range(3)
    ]  # fmt: skip
    lines = limb_sheet(exo.mechanism, StudyTable(rows)).splitlines()
    cells = {line.split("  ")[0]: line.split("  ", 1)[1].split("  ") for line in lines[:11]}
    table = {head: [cell.strip() for cell in rest if cell.strip()] for head, rest in cells.items()}
    assert table == {
        "limb": ["1", "2", "3"],
        "joint on the frame, mm": ["0, 100, 300", "300, 0, 100", "100, 300, 0"],
        "joint on the cuff, mm": ["0, 100, -200", "-200, 0, 100", "100, -200, 0"],
        "actuator, mm": ["450 to 550", "- to -", "- to -"],
        "used, mm": ["460 to 520", "470 to 530", "480 to 540"],
        "force for the least |F_s|, N": ["-12 to 100", "-11 to 101", "-10 to 102"],
        "clear of arm, mm": ["10", "11", "12"],
        "clear of torso, mm": ["-", "-", "-"],
        "clear of other limbs, mm": ["30", "31", "32"],
        "cone at the frame, °": ["20", "21", "22"],
        "cone at the cuff, °": ["30", "31", "32"],
    }
    assert lines[11].startswith("tilt of a turning fork on the cuff, °")
    assert lines[11].split()[-3:] == ["5", "6", "7"]
    # Words to the left, figures to the right, below each other.
    assert len({len(line) for line in lines[:12]}) == 1
    assert len(lines) > 12


@pytest.mark.parametrize("mass", [0.02, 2.0])
def test_what_a_lost_limb_misses_as_a_share_of_the_weight(mass):
    """However light the arm: of one pose it is the missing moment over that of the weight."""
    exo = three(mass=mass)
    found = exo.workspace(exo.pose([20.0], [10.0], [5.0]), ["singularity"])
    table = limb_loss(exo.mechanism, found)
    lever = found.poses.as_matrix()[0] @ [0.0, 0.0, -0.25]
    weight = np.linalg.norm(np.cross(lever, [0.0, 0.0, -9.81 * mass]))
    assert weight < 1.0 or mass > 1.0
    assert (table["missing_Nm"] > 1e-6 * mass).any()
    np.testing.assert_allclose(table["missing_share"], table["missing_Nm"] / weight)
    # The hanging arm of no moment lacks none, and nothing is divided by it.
    hanging = limb_loss(exo.mechanism, exo.workspace(exo.pose(), ["singularity"]))
    assert hanging["missing_share"].tolist() == [0.0] * 3


def test_a_criterion_is_sent_by_its_name_and_another_by_its_parts():
    stroke = CRITERIA["stroke"]
    assert pickle.loads(pickle.dumps(stroke)) is stroke
    mine = Criterion("stroke", "m", "mine", "#117733", np.max, 0.05)
    again = pickle.loads(pickle.dumps(mine))
    assert again == mine
    assert again is not stroke
    assert (again.words, again.margin) == ("mine", np.max)


def reached(inside, met, tensions=None):
    met = {name: np.array(values) for name, values in met.items()}
    inside = np.array(inside)
    return SimpleNamespace(inside=inside, index=float(inside.mean()), met=met, tensions=tensions)


def rates(values, turning=(False, False), limits=((NAN, NAN), (NAN, NAN))):
    own = object.__new__(tasks._Rates)
    own.values, own.turning, own.limits = np.array(values, dtype=float), np.array(turning), np.array(limits)
    return own


def test_what_limits_a_task():
    """The criterion that most of the poses outside do not meet; poses inside meet all."""
    still = rates(np.empty((0, 2)))
    for inside, met, limited in (
        ([True, True], {"stroke": [True, True], "forces": [True, True]}, ""),
        ([True, False], {"stroke": [True, True], "forces": [True, False]}, "forces"),
        ([False, False, True], {"stroke": [False, True, True], "forces": [False, False, True]}, "forces"),
        ([False, False, True], {"stroke": [False, False, True], "forces": [False, True, True]}, "stroke"),
        ([False, False], {"stroke": [False, False], "forces": [True, True]}, "stroke"),
        ([True, True], {}, ""),
    ):
        row = tasks._row("reach", "published range", reached(inside, met), still)
        assert row["limited_by"] == limited
        assert (row["task"], row["data"], row["poses"]) == ("reach", "published range", len(inside))
        assert row["inside"] == np.mean(inside)
        assert np.isnan([row["fastest_limb_m_s"], row["largest_power_W"], row["fast_enough"]]).all()
        assert "fastest_joint_rad_s" not in row


def test_speed_and_power_of_a_movement_by_hand():
    """Power is what an actuator gives, so that what it takes up counts as none; slides and hinges apart."""
    found = reached([True, True], {}, tensions=np.array([[10.0, -20.0], [30.0, 5.0]]))
    own = rates([[0.5, 0.25], [-2.0, -0.1]], limits=[[3.0, 0.3], [6.0, 5.0]])
    np.testing.assert_allclose(own.power(found.tensions), [[5.0, 0.0], [0.0, 0.0]])
    row = tasks._row("lift", "movement", found, own)
    assert (row["fastest_limb_m_s"], row["largest_power_W"], row["fast_enough"]) == (2.0, 5.0, 1.0)
    # Of a single sample, too.
    one = tasks._row(
        "lift", "movement", reached([True], {}, found.tensions[:1]), rates(own.values[:1], limits=own.limits)
    )
    assert (one["largest_power_W"], one["fast_enough"]) == (5.0, 1.0)
    both = tasks._row("lift", "movement", found, rates(own.values, turning=[False, True]))
    assert (both["fastest_limb_m_s"], both["fastest_joint_rad_s"]) == (2.0, 0.25)
    for limits, share in (
        ([[1.9, 0.3], [6.0, 5.0]], 0.5),  # too fast in the second sample
        ([[3.0, 0.3], [4.9, 5.0]], 0.5),  # too strong in the first
        ([[2.0, 0.25], [5.0, 5.0]], 1.0),  # just at the limits
        ([[NAN, 0.3], [5.0, NAN]], 1.0),
        ([[NAN, 0.3], [4.0, NAN]], 0.5),
        ([[1.0, 0.2], [1.0, 1.0]], 0.0),
        ([[NAN, 0.3], [NAN, NAN]], NAN),  # nothing is known of the first
    ):
        np.testing.assert_equal(rates(own.values, limits=limits).fast_enough(own.power(found.tensions)), share)
    nobody = rates(np.empty((2, 0)), turning=np.zeros(0, dtype=bool), limits=np.empty((2, 0)))
    assert np.isnan(nobody.fast_enough(np.empty((2, 0))))


def lift(exo, degrees=60.0):
    angles = degrees * np.sin(np.linspace(0.0, np.pi / 2, 41)) ** 2
    return ep.Movement.from_samples(np.linspace(0.0, 2.0, 41), exo.pose(angles, 10.0, 5.0), smoothing=None)


def test_rates_of_limbs_are_how_fast_they_become_shorter():
    """A tension does work where its limb becomes shorter; speeds by differences of the lengths."""
    exo = three(actuator=replace(LINEAR, speed_limit=0.3, power_limit=40.0))
    movement = lift(exo, 30.0)
    own = tasks._Rates(exo.mechanism, movement)
    lengths = exo.inverse_kinematics(movement.poses).lengths
    speed = -np.gradient(lengths, 2.0 / 40.0, axis=0)
    np.testing.assert_allclose(own.values[3:-3], speed[3:-3], atol=2e-3)
    assert np.abs(own.values).max() > 0.03
    np.testing.assert_array_equal(own.limits, [[0.3] * 3, [40.0] * 3])
    assert own.turning.tolist() == [False] * 3
    assert np.isnan(tasks._Rates(three(actuator=None).mechanism, None).limits).all()
    table = task_reach(exo.mechanism, {"lift": movement}, (), ["singularity", "forces"])
    assert table["fastest_limb_m_s"][0] == pytest.approx(np.abs(own.values).max())


def test_drives_in_hinges_turn_and_those_in_slides_do_not():
    device = ChainDevice.from_chain(ep.load("prototype").chain)
    assert tasks._Rates(device, None).turning.tolist() == [False] * 3
    hinge = next(name for name in device.chain.model.names if name.endswith("base_x"))
    turned = device.replace(drives=[Drive("crank", joint=hinge), *device.drives[1:]])
    assert tasks._Rates(turned, None).turning.tolist() == [True, False, False]


def test_ranges_come_after_movements_on_a_grid_of_their_own():
    exo = three()
    box = RangeOfMotion("reach", (0.0, 20.0), (0.0, 10.0), (0.0, 0.0))
    table = task_reach(exo.mechanism, {"lift": lift(exo, 10.0)}, [box], ["singularity"], step=10.0)
    assert table["task"].tolist() == ["lift", "reach"]
    assert table["data"].tolist() == ["movement", "published range"]
    assert table["poses"].tolist() == [41, 6]
    assert np.isnan(table["fast_enough"]).all()
    # Of 8° unless another step is asked for.
    own = RangeOfMotion("reach", (0.0, 16.0), (0.0, 8.0), (0.0, 0.0))
    assert task_reach(exo.mechanism, None, [own], ["singularity"])["poses"].tolist() == [6]
    # On a grid "connected" is asked, of a movement it is not.
    both = task_reach(exo.mechanism, {"lift": lift(exo, 10.0)}, [box], ["singularity", "connected"], step=10.0)
    np.testing.assert_array_equal(both["inside"], table["inside"])
    with pytest.raises(InvalidInput, match="a RangeOfMotion, got str"):
        task_reach(exo.mechanism, None, ["reach"])
