"""The shoulder unit: the ends of its range, friction, the second flange; and where the plant rests."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import SolverFailed
from exo_pin.control.plant.equations.plant_kernels import stop_moment


def stop(orientation, side=1.0, w=(0.0, 0.0, 0.0), damping=0.0):
    rows = tuple(tuple(row) for row in orientation.as_matrix().tolist())
    return stop_moment(rows, w, np.pi / 2, np.radians(95.0), side, 100.0, damping)


@pytest.mark.parametrize("side", ["left", "right"])
def test_stops_push_where_the_shoulder_does_not_reach(side):
    shoulder = ep.load("prototype", side=side).mechanism.shoulder
    sign = 1.0 if side == "left" else -1.0
    turns = Rotation.random(4000, rng=np.random.default_rng(5))
    allowed = shoulder.allows(turns, side)
    potential = np.array([stop(turn, sign)[2] for turn in turns])
    # The corners of |.| are rounded off by up to 0.01 rad each, outwards.
    depth = np.sqrt(2.0 * potential / 100.0)
    assert not potential[allowed].any()
    assert (potential[~allowed] > 0.0).mean() > 0.95
    assert 0.1 < allowed.mean() < 0.4
    assert depth.max() > 0.5


def test_the_moment_is_minus_the_potential_s_gradient():
    rng, checked = np.random.default_rng(6), 0
    for turn in Rotation.random(300, rng=rng):
        moment, _, potential = stop(turn)
        if potential == 0.0 or abs(turn.as_matrix()[1, 2]) > 0.99:
            continue
        gradient = np.array(
            [
                (stop(Rotation.from_rotvec(h) * turn)[2] - stop(Rotation.from_rotvec(-h) * turn)[2]) / 2e-6
                for h in 1e-6 * np.eye(3)
            ]
        )
        if np.linalg.norm(gradient + moment) > 1e-4 * np.linalg.norm(gradient):
            # Where the two triples of angles are equally deep the potential has a ridge.
            assert abs(abs(turn.as_euler("YXZ")[2]) - np.pi / 2) < 0.6
            continue
        checked += 1
    assert checked > 50


def test_a_stop_damps_and_does_not_pull():
    turn = ep.shoulder_rotation(0.0, -8.0, 0.0, degrees=True)
    moment, loss, potential = stop(turn)
    assert moment[0] > 0.0
    assert potential > 0.0
    assert loss == 0.0
    inwards, lost, _ = stop(turn, w=(-1.0, 0.0, 0.0), damping=1.0)
    assert inwards[0] > moment[0]
    assert lost > 0.0
    outwards, lost, _ = stop(turn, w=(50.0, 0.0, 0.0), damping=1.0)
    assert np.abs(outwards).max() == 0.0
    assert lost > 0.0


def test_the_prototype_rests_off_zero_as_in_section_5_4(prototype):
    """Muscle 1 is too short for the arm to hang straight: the thesis saw -13.4° about Y, and 150 mm is its end."""
    plant = ep.Plant(prototype)
    rest = plant.rest()
    angles = ep.thesis_angles(rest.orientation, degrees=True)
    assert angles[1] == pytest.approx(-12.9, abs=0.1)
    run = plant.simulate(lambda t, seen: [-1.0, -1.0, -1.0], 0.5)
    assert np.abs(run.angular_velocity).max() < 1e-9
    assert run.tensions[0, 0] > 2.0
    assert not run.tensions[:, 1:].any()
    assert 0.150 < run.lengths[0, 0] - 0.126 < 0.151
    # Longer muscles, or a softer braid, let it hang farther down.
    soft = ep.Plant(prototype, ep.PlantOptions(braid_stiffness=300.0)).rest()
    assert ep.thesis_angles(soft.orientation, degrees=True)[1] > angles[1] + 1.0


def test_air_holds_the_arm_up_on_one_side_of_the_singularity_only(prototype, abducted):
    """With the same pressures the plant has two rests, on both sides of det X = 0."""
    plant = ep.Plant(prototype)
    pressures = [2e5, 0.0, 4e5]
    hanging, up = plant.rest(pressures), plant.rest(pressures, near=abducted)
    low, high = (ep.shoulder_angles(state.orientation, degrees=True)[1] for state in (hanging, up))
    assert low < 0.0
    assert 50.0 < high < 75.0
    signs = [np.sign(prototype.singularity(state.orientation).determinant) for state in (hanging, up)]
    assert signs[0] != signs[1]


def test_a_rest_without_an_end_is_refused(prototype):
    """A free arm without weight never stops being pushed around by nothing: every pose is a rest, none is stable."""
    loose = prototype.replace(gravity=(0.0, 0.0, 0.0))
    plant = ep.Plant(loose, ep.PlantOptions(second_flange=True))
    with pytest.raises(SolverFailed):
        plant.rest(near=ep.shoulder_rotation(30.0, 40.0, 0.0, degrees=True))


def test_dry_friction_holds_the_arm_where_it_is_put(prototype):
    start = ep.shoulder_rotation(30.0, 10.0, 0.0, degrees=True)
    plant = ep.Plant(prototype, ep.PlantOptions(shoulder_coulomb=1.5, shoulder_viscous=0.5))
    held = plant.simulate(lambda t, seen: [-1.0] * 3, 2.0, plant.state(start))
    moment = held.plant.tables.mass * 9.81 * np.linalg.norm(start.apply(held.plant.tables.centre)[:2])
    assert moment < 1.5
    # Elastic up to the presliding turn, and no creep.
    assert (held.rotations * start.inv()).magnitude().max() < 4e-3
    assert (held.rotations[-1] * held.rotations[100].inv()).magnitude() < 1e-6
    free = ep.Plant(prototype).simulate(lambda t, seen: [-1.0] * 3, 2.0, plant.state(start))
    assert (free.rotations[-1] * start.inv()).magnitude() > 0.2


def test_the_second_flange_frees_the_arm(prototype):
    start = ep.shoulder_rotation(20.0, 40.0, -70.0, degrees=True)
    assert not prototype.mechanism.shoulder.allows(start)
    for flange in (False, True):
        plant = ep.Plant(prototype, ep.PlantOptions(second_flange=flange))
        run = plant.simulate(lambda t, seen: [-1.0] * 3, 0.05, plant.state(start))
        assert (np.abs(run.stop_moment).max() > 1.0) != flange


def test_a_series_spring_lets_the_arm_hang_straighter(prototype):
    stiff, sprung = (ep.Plant(prototype, ep.PlantOptions(series_spring=k)).rest() for k in (None, 150.0))
    tilt = [abs(ep.thesis_angles(state.orientation, degrees=True)[1]) for state in (stiff, sprung)]
    assert tilt[1] < tilt[0] - 3.0
