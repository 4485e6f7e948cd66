"""Inverse dynamics of planar mechanisms against Newton-Euler of every link by hand (tests/planar_oracle.py)."""

import numpy as np
import pytest
from mechanisms import five_bar, four_bar
from planar_oracle import Turning, dyad, e, n, newton_euler, rates, rod_link

SEEDS = range(12)
GROUND = -1
COUPLER, ROCKER = np.sqrt(0.5), 0.5


def drawn(rng):
    """Gravity in the plane, and a load on a link: force and moment."""
    return rng.normal(size=2) * 10, rng.normal(size=2) * 20, rng.normal() * 3


def asked(chain, angles, load_on, gravity, load):
    """Inverse dynamics at joint coordinates (q, v, a) by name, with a load in the plane on a link's origin."""
    chain.model.gravity.linear = np.array([*gravity, 0.0])
    q, v, a = np.zeros((3, chain.model.nv))
    for joint, values in angles.items():
        q[chain.configuration_slice(joint)], v[chain.velocity_slice(joint)], a[chain.velocity_slice(joint)] = values
    force, moment = load
    assert np.abs(chain.residual(q)).max() < 1e-14
    return chain.inverse_dynamics(q, v, a, external={load_on: [*force, 0.0, 0.0, 0.0, moment]})


def minus(one, other):
    return tuple(np.subtract(one, other))


def four_bar_motion(rng, still):
    """Crank, coupler and rocker away from singular poses, on either branch."""
    base, far = np.zeros(2), np.array([0.4, 0.0])
    while True:
        angle, branch = rng.uniform(0.3, 2.6), rng.choice([-1.0, 1.0])
        found = dyad(0.3 * e(angle), far, (COUPLER, ROCKER), branch)
        if found is not None and abs(np.sin(found[0] - found[1])) > 0.2:
            break
    speed, acceleration = (0.0, 0.0) if still else (rng.normal() * 4, rng.normal() * 30)
    crank = Turning(angle, speed, acceleration)
    # Crank tip + coupler + way down the rocker = far pivot: the two links' tips move against the crank's tip.
    tip = base + 0.3 * e(angle)
    coupler, down = rates(found, (COUPLER, ROCKER), -0.3 * speed * n(angle), -crank.arm(0.3))
    rocker = Turning(down.angle + np.pi, down.rate, down.acceleration)
    return crank, coupler, rocker, tip, far


def assert_pins(forces, by_hand, names):
    largest = max(np.abs(by_hand[pin]).max() for pin in names.values())
    for joint, pin in names.items():
        expressed = forces.joint_reaction(joint)
        np.testing.assert_allclose(expressed.force[:2], by_hand[pin], rtol=0, atol=1e-9 * max(largest, 1.0))
        assert expressed.unique[[0, 1, 5]].all()


@pytest.mark.parametrize("still", [True, False])
@pytest.mark.parametrize("seed", SEEDS)
def test_a_four_bar_cut_in_a_link_transmits_the_moment_of_the_link_there(seed, still):
    rng = np.random.default_rng(1000 + seed)
    crank, coupler, rocker, tip, far = four_bar_motion(rng, still)
    gravity, force, moment = drawn(rng)
    joint, middle = far + ROCKER * e(rocker.angle), far + 0.25 * e(rocker.angle)
    links = [
        rod_link(np.zeros(2), np.zeros(2), crank, 0.3),
        rod_link(tip, crank.arm(0.3), coupler, COUPLER),
        rod_link(joint, rocker.arm(ROCKER), rocker, 0.25, -1.0),
        rod_link(far, np.zeros(2), rocker, 0.25),
    ]
    pins = {"A": (0, GROUND, np.zeros(2)), "B": (1, 0, tip), "C": (2, 1, joint), "D": (3, GROUND, far)}
    loads = [(2, joint, force, moment)]
    by_hand = newton_euler(links, pins, {"motor": (0, GROUND)}, loads, gravity, {"weld": (2, 3, middle)})
    upper = (rocker.angle - np.pi, rocker.rate, rocker.acceleration)
    angles = {
        "crank_hinge": crank,
        "coupler_hinge": minus(coupler, crank),
        "upper_hinge": minus(upper, coupler),
        "lower_hinge": rocker,
    }
    forces = asked(four_bar("link").chain(), angles, "upper", gravity, (force, moment))
    assert forces.effort("crank_hinge")[0] == pytest.approx(by_hand["motor"], rel=1e-9, abs=1e-9)
    names = {"crank_hinge": "A", "coupler_hinge": "B", "upper_hinge": "C", "lower_hinge": "D"}
    assert_pins(forces, by_hand, names)
    weld_force, weld_moment = by_hand["weld"]
    weld = forces.joint_reaction("middle")
    np.testing.assert_allclose(weld.force[:2], weld_force, rtol=0, atol=1e-9 * max(np.abs(weld_force).max(), 1.0))
    assert weld.moment[2] == pytest.approx(weld_moment, rel=1e-9, abs=1e-9)
    # The other half, about another point, in the half's own axes.
    lower = forces.joint_reaction("middle", on="lower", at="lower", in_frame="lower")
    about = -weld_moment - (middle - far)[0] * weld_force[1] + (middle - far)[1] * weld_force[0]
    assert lower.moment[2] == pytest.approx(about, rel=1e-9, abs=1e-9)
    along = [-weld_force @ e(rocker.angle), -weld_force @ n(rocker.angle)]
    np.testing.assert_allclose(lower.force[:2], along, rtol=0, atol=1e-9 * max(np.abs(weld_force).max(), 1.0))


def five_bar_motion(rng, still):
    """Left crank, left forearm, right crank, right forearm."""
    bases = np.array([[-0.1, 0.0], [0.1, 0.0]])
    while True:
        cranks = np.array([np.arctan2(4, -3), np.arctan2(4, 3)]) + rng.uniform(-0.7, 0.7, 2)
        elbows = [base + 0.2 * e(angle) for base, angle in zip(bases, cranks, strict=True)]
        found = dyad(elbows[0], elbows[1], (0.275, 0.275), rng.choice([-1.0, 1.0]))
        if found is not None and abs(np.sin(found[0] - found[1])) > 0.2:
            break
    speeds, accelerations = np.zeros((2, 2)) if still else rng.normal(size=(2, 2)) * [[4], [30]]
    left, right = (Turning(*item) for item in zip(cranks, speeds, accelerations, strict=True))
    apart = 0.2 * (right.rate * n(right.angle) - left.rate * n(left.angle))
    forearm, back = rates(found, (0.275, 0.275), apart, right.arm(0.2) - left.arm(0.2))
    return bases, elbows, left, forearm, right, Turning(back.angle + np.pi, back.rate, back.acceleration)


@pytest.mark.parametrize("still", [True, False])
@pytest.mark.parametrize("seed", SEEDS)
def test_five_bars_torques_and_pin_forces_are_those_of_its_free_links(seed, still):
    rng = np.random.default_rng(2000 + seed)
    bases, elbows, left, left_forearm, right, right_forearm = five_bar_motion(rng, still)
    gravity, force, moment = drawn(rng)
    links = [
        rod_link(bases[0], np.zeros(2), left, 0.2),
        rod_link(elbows[0], left.arm(0.2), left_forearm, 0.275),
        rod_link(bases[1], np.zeros(2), right, 0.2),
        rod_link(elbows[1], right.arm(0.2), right_forearm, 0.275),
    ]
    tip = elbows[0] + 0.275 * e(left_forearm.angle)
    pins = {
        "left_crank_hinge": (0, GROUND, bases[0]),
        "left_forearm_hinge": (1, 0, elbows[0]),
        "right_crank_hinge": (2, GROUND, bases[1]),
        "right_forearm_hinge": (3, 2, elbows[1]),
        "tip": (1, 3, tip),
    }
    motors = {"left": (0, GROUND), "right": (2, GROUND)}
    # The load acts at the tip, a frame of the left forearm that is not the forearm's own.
    by_hand = newton_euler(links, pins, motors, [(1, tip, force, moment)], gravity)
    angles = {
        "left_crank_hinge": left,
        "left_forearm_hinge": minus(left_forearm, left),
        "right_crank_hinge": right,
        "right_forearm_hinge": minus(right_forearm, right),
    }
    forces = asked(five_bar().chain(), angles, "tip", gravity, (force, moment))
    for side in ("left", "right"):
        assert forces.effort(f"{side}_crank_hinge")[0] == pytest.approx(by_hand[side], rel=1e-9, abs=1e-9)
    assert_pins(forces, by_hand, {name: name for name in pins})
    # The base carries all of it, with the motors' torques, at the world's origin.
    load = forces.wrench_on("universe")
    on_base = -by_hand["left_crank_hinge"] - by_hand["right_crank_hinge"]
    np.testing.assert_allclose(load.force[:2], on_base, rtol=0, atol=1e-9 * max(np.abs(on_base).max(), 1.0))
    turn = -by_hand["left"] - by_hand["right"]
    turn -= bases[0][0] * by_hand["left_crank_hinge"][1] + bases[1][0] * by_hand["right_crank_hinge"][1]
    assert load.moment[2] == pytest.approx(turn, rel=1e-9, abs=1e-9)
