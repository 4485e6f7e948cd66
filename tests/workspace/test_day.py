"""Tasks of a day: the hand is where the task is, on a body and a device computed here anew."""

import numpy as np
import pytest

import exo_pin as ep
from exo_pin.design.obstacles import obstacle
from exo_pin.workspace import day_reach

MAN = ep.Wearer(1.755, 85, "male")


@pytest.fixture(scope="module")
def exo():
    return ep.load("four-linear-actuators-worn").worn_by(MAN)


@pytest.fixture(scope="module")
def day(exo):
    return day_reach(exo, step=15.0)


def hands(day, wearer):
    """Places of the hand, shape (tasks, swivels, 3), from the poses and bends alone."""
    upper, fore, bend = wearer.upper_arm_length, wearer.forearm_length, day.elbow_flexion
    own = np.stack([fore * np.sin(bend), 0.0 * bend, -upper - fore * np.cos(bend)], axis=1)
    return np.einsum("kpij,kj->kpi", day.poses.as_matrix(), own)


def depth(point, capsule):
    """How far a point is outside a capsule, m."""
    first, last, radius = capsule[:3], capsule[3:6], capsule[6]
    share = np.clip((point - first) @ (last - first) / max((last - first) @ (last - first), 1e-18), 0.0, 1.0)
    return np.linalg.norm(point - first - share * (last - first)) - radius


def test_every_swivel_leaves_the_hand_where_it_is(day):
    places = hands(day, MAN)
    assert np.abs(places - places[:, :1]).max() < 1e-12


def test_a_car_seat_holds_back_and_head_from_behind():
    rows, torso = obstacle("car", MAN), ep.BodyShape.of(MAN).torso
    rods, head = rows[:, [0, 3]].max(axis=1) + rows[:, 6], torso[6]
    behind = np.where(rows[:, 5] > 0.01, rods + head[6], 0.0)
    # The restraint is 55 mm behind the head and ends 830 mm above a hip at 0.530 of stature.
    assert behind.min() == pytest.approx(-0.055)
    assert (rows[:, 5] + rows[:, 6]).max() == pytest.approx(0.83 - (0.818 - 0.530) * 1.755)
    assert rods[rows[:, 5] < 0.0].max() == pytest.approx(obstacle("chair", MAN)[0, 0] + 0.015)


@pytest.mark.parametrize(
    ("task", "parts", "where"),
    [
        ("soup, at a table", (6,), (1, 0, 0)),
        ("telephone", (6,), (0, 1, 0)),
        ("comb", (6,), (-1, 0, 1)),
        ("back pocket", (2, 3), (-1, 0, 0)),
        ("seat belt's buckle", (2, 3), (1, -1, 0)),
        ("jacket, second sleeve", (2, 3), (-1, 0, 0)),
    ],
)
def test_the_hand_is_on_that_part_of_the_body(day, task, parts, where):
    torso = ep.BodyShape.of(MAN).torso
    place = hands(day, MAN)[day.tasks.index(task), 0]
    gaps = [depth(place, torso[part]) for part in parts]
    assert min(gaps) == pytest.approx(0.0, abs=0.01)  # a back has a hollow in its middle
    part = torso[parts[int(np.argmin(gaps))]]
    middle = np.mean(torso[list(parts)], axis=0)
    outward = place - 0.5 * (middle[:3] + middle[3:6])
    assert all(np.sign(outward[axis]) == way for axis, way in enumerate(where) if way and part[6])


def test_the_opposite_shoulder_is_as_far_off_as_the_shoulders_are_apart(day):
    place = hands(day, MAN)[day.tasks.index("other shoulder"), 0]
    assert place[1] == pytest.approx(2.0 * ep.BodyShape.of(MAN).torso[6, 1])


def test_forces_are_those_of_the_bent_arm_in_its_poses(exo, day):
    row = day.tasks.index("telephone")
    worn = exo.worn_by(ep.Wearer(1.755, 85, "male", elbow_flexion=day.elbow_flexion[row]))
    answer = worn.reaction(day.poses[row][day.inside[row]], split="minimal")
    assert day.inside[row].any()
    np.testing.assert_allclose(day.shoulder_force[row][day.inside[row]], answer.magnitude, rtol=1e-6)
    assert answer.can_hold.all()


@pytest.mark.parametrize(("task", "lean"), [("in bed, hand to mouth", 90.0), ("in a car, hand to mouth", 25.0)])
def test_in_bed_and_in_a_car_weight_pulls_to_the_back(exo, task, lean):
    found = day_reach(exo, ["stroke", "forces"], step=15.0)
    row, down = found.tasks.index(task), np.linalg.norm(exo.device.gravity)
    lying = exo.worn_by(ep.Wearer(1.755, 85, "male", elbow_flexion=found.elbow_flexion[row]))
    lying = lying.replace(gravity=[-down * np.sin(np.radians(lean)), 0.0, -down * np.cos(np.radians(lean))])
    answer = lying.reaction(found.poses[row][found.inside[row]], split="minimal")
    assert found.inside[row].any()
    np.testing.assert_allclose(found.shoulder_force[row][found.inside[row]], answer.magnitude, rtol=1e-6)


def test_a_design_that_does_nothing_still_says_what_the_person_reaches():
    day = day_reach(ep.load("prototype").worn_by(MAN), step=15.0)
    assert day.possible.any(axis=1).all()
    assert not day.inside.any()
    assert set(day.table["can_do"]) == {"no"}
    assert not set(day.table["limited_by"]) & {""}


def test_a_right_arm_does_the_same(exo, day):
    right = day_reach(exo.mirrored(), step=15.0)
    np.testing.assert_array_equal(right.inside, day.inside)
    np.testing.assert_allclose(right.shoulder_force, day.shoulder_force, rtol=1e-6)
    np.testing.assert_allclose(hands(right, MAN), hands(day, MAN) * [1.0, -1.0, 1.0], atol=1e-12)
    assert str(right.table) == str(day.table)


def test_the_table_counts_what_the_arrays_hold(day):
    for k, row in enumerate(zip(*(day.table[name] for name in ("swivels", "inside", "can_do")), strict=True)):
        assert row[0] == day.possible[k].sum()
        assert row[1] == pytest.approx(day.inside[k].sum() / day.possible[k].sum())
        assert row[2] == ("yes" if day.inside[k].any() else "no")
    assert not (day.inside & ~day.possible).any()
    assert f"does {sum(day.table['can_do'] == 'yes')} of 14" in str(day)


def test_obstacles_count_task_by_task(exo):
    free = day_reach(exo, ["clearance", "stroke"], step=15.0)
    row = free.tasks.index("in bed, hand to mouth")
    soup = free.tasks.index("soup, at a table")
    worn = exo.worn_by(ep.Wearer(1.755, 85, "male", elbow_flexion=free.elbow_flexion[row]))
    for name, task in (("bed", row), ("chair", soup)):
        limits = ep.Criteria(("clearance", "stroke"), obstacles=(name,))
        found = worn.workspace(free.poses[task][free.possible[task]], criteria=limits)
        np.testing.assert_array_equal(found.inside, free.inside[task][free.possible[task]])


def test_what_is_asked_of_nobody_or_twice_is_refused(exo):
    with pytest.raises(ep.MissingData, match="who wears it"):
        day_reach(ep.load("prototype"))
    with pytest.raises(ep.InvalidInput, match="own"):
        day_reach(exo, ep.Criteria(obstacles=("chair",)))
    with pytest.raises(ep.InvalidInput, match="step"):
        day_reach(exo, step=0.0)


@pytest.mark.full
@pytest.mark.parametrize("file", ["serial-y-x-z.urdf", "nesm.urdf"])
def test_other_kinds_have_a_day_too(file):
    found = day_reach(ep.load(f"urdf/{file}").worn_by(MAN), step=20.0)
    assert found.summary()["tasks"] == 14
    assert found.possible.any()
