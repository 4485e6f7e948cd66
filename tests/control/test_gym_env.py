"""The Gymnasium environment: its own checker, and rollouts that are runs."""

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import exo_pin as ep
from exo_pin import control
from exo_pin.control.gym_env import ShoulderEnv


def lift(generator):
    """A lift to a drawn angle."""
    end = generator.uniform(20.0, 50.0)
    return control.AnglePath([0.0, 0.5], np.radians([[10.0, 0.0, 0.0], [end, 0.0, 0.0]]), "left", "minimum_jerk")


def test_gymnasiums_own_checker_passes():
    check_env(ShoulderEnv(ep.load("four-cables"), lift, duration=0.1), skip_render_check=True)


@pytest.mark.parametrize("wearer", [(), control.Tremor(0.2, 5.0, (0.0, 1.0, 0.0))])
def test_a_rollout_is_a_run_bit_for_bit(wearer):
    env = ShoulderEnv(ep.load("four-cables"), control.flexion(), duration=0.05, wearer=wearer)
    env.reset(seed=3)
    start, generator = env.state, np.random.default_rng(0)
    actions = generator.uniform(0.05, 0.3, (5, 4))
    seen = [env.step(action) for action in actions]
    run = env.plant.simulate(lambda t, now: actions[round(100.0 * t)], 0.05, start)
    assert (run.state(0.05).quaternion == env.state.quaternion).all()
    assert (run.state(0.05).drive_positions == env.state.drive_positions).all()
    assert [truncated for *_, truncated, _ in seen] == [False] * 4 + [True]
    force = np.linalg.norm(run.shoulder_force[-1])
    error = np.linalg.norm(seen[-1][0][:3])
    weight = env.plant.tables.mass * 9.81
    assert seen[-1][1] == pytest.approx(-((np.degrees(error) / 5.0) ** 2) - force / weight)


def test_the_reference_is_drawn_by_the_seed():
    env = ShoulderEnv(ep.load("four-cables"), lift)
    ends = []
    for seed in (1, 1, 2):
        env.reset(seed=seed)
        ends.append(env.reference(0.5).orientation.magnitude())
    assert ends[0] == ends[1] != ends[2]


def test_what_is_no_episode_is_refused():
    env = ShoulderEnv(ep.load("four-cables"), lift)
    with pytest.raises(ep.InvalidInput, match="reset"):
        env.step(np.zeros(4))
    with pytest.raises(ep.InvalidInput, match="options"):
        env.reset(options={"pose": 1})
    with pytest.raises(ep.InvalidInput, match="Reference"):
        ShoulderEnv(ep.load("four-cables"), 3)
