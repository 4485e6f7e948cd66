"""Tasks of a day: the hand is where the task is, on a body and a device computed here anew."""

import numpy as np
import pytest

import exo_pin as ep
from exo_pin.workspace import day_reach
from exo_pin.workspace.day import bend_to

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


def test_a_hand_gets_no_further_than_the_arm_is_long_and_no_nearer_than_it_bends():
    """By the law of cosines."""
    way, long, most = np.array([0.6, 0.0, -0.8]), MAN.upper_arm_length + MAN.forearm_length, 2.6
    short = np.sqrt(long**2 - 2.0 * MAN.upper_arm_length * MAN.forearm_length * (1.0 - np.cos(most)))
    assert bend_to(0.9999 * long * way, MAN) < 0.05
    assert bend_to(1.0001 * short * way, MAN) == pytest.approx(most, abs=1e-3)
    nearest = abs(MAN.upper_arm_length - MAN.forearm_length)
    for far in (1.0001 * long, 1.04 * long, 0.9999 * short, 1.01 * nearest, 0.9 * nearest, 0.0):
        assert np.isnan(bend_to(far * way, MAN))


def test_every_swivel_leaves_the_hand_where_it_is(day):
    places = hands(day, MAN)
    assert np.abs(places - places[:, :1]).max() < 1e-12


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


def test_forces_are_those_of_the_bent_arm_in_its_poses(exo, day):
    row = day.tasks.index("telephone")
    worn = exo.worn_by(ep.Wearer(1.755, 85, "male", elbow_flexion=day.elbow_flexion[row]))
    answer = worn.reaction(day.poses[row][day.inside[row]], split="minimal")
    assert day.inside[row].any()
    np.testing.assert_allclose(day.shoulder_force[row][day.inside[row]], answer.magnitude, rtol=1e-6)
    assert answer.can_hold.all()
