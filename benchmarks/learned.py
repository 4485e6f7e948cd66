"""A controller that is learned: a linear policy by the cross-entropy method, on the Gymnasium environment (extra gym).

    python benchmarks/learned.py [generations]

Four cables hold and lift an arm to a pose that the seed draws. The commands are a constant and a linear function of the
turn to the reference, the angular velocity of the arm and its reference. It learns from seeds below 1000, and is judged
on fifty others, beside motors without commands and the best constant ones.
"""

from __future__ import annotations

import sys
import warnings

import numpy as np

import exo_pin as ep
from exo_pin import control
from exo_pin.control.gym_env import ShoulderEnv

_DURATION, _RATE, _DRAWS, _BEST, _EPISODES = 0.6, 50.0, 24, 6, 3
#: What the policy sees of an observation: turn, ω, reference's ω; their sizes, rad and rad/s.
_SEEN, _SIZES = 9, np.repeat([0.2, 1.0, 1.0], 3)


def lift(random: np.random.Generator) -> control.AnglePath:
    """A lift by 15° of flexion from a pose that is drawn."""
    flexion, abduction = random.uniform(15.0, 45.0), random.uniform(0.0, 25.0)
    way = np.radians([[flexion, abduction, 0.0], [flexion + 15.0, abduction, 0.0]])
    return control.AnglePath([0.0, 0.4], way, "left", "minimum_jerk")


def environment() -> ShoulderEnv:
    """What is learned."""
    return ShoulderEnv(ep.load("four-cables"), lift, _DURATION, _RATE)


def episode(env: ShoulderEnv, policy: np.ndarray, seed: int) -> tuple[float, float]:
    """Mean reward and root mean square error, degrees, of a policy, shape (n, 10), in an episode."""
    seen, _ = env.reset(seed=seed)
    rewards, errors, done = [], [], False
    while not done:
        action = np.clip(policy @ np.concatenate([[1.0], seen[:_SEEN] / _SIZES]), -1.0, 1.0)
        seen, reward, ended, done, more = env.step(action)
        rewards.append(reward)
        errors.append(more["error"])
        done = done or ended
    return float(np.mean(rewards)), float(np.degrees(np.sqrt(np.mean(np.square(errors)))))


def learned(env: ShoulderEnv, generations: int, start: np.ndarray, spread: np.ndarray) -> np.ndarray:
    """The policy after some generations, shape (n, 10), from a first one and how far draws are from it."""
    random, mean, least = np.random.default_rng(0), start, 0.05 * spread
    for k in range(generations):
        draws = mean + spread * random.normal(size=(_DRAWS, *start.shape))
        seeds = random.integers(0, 1000, _EPISODES)
        rewards = [np.mean([episode(env, draw, int(own))[0] for own in seeds]) for draw in draws]
        best = draws[np.argsort(rewards)[-_BEST:]]
        mean, spread = best.mean(axis=0), best.std(axis=0) + least
        print(f"generation {k + 1}: best reward {max(rewards):.2f}", file=sys.stderr, flush=True)
    return mean


def main() -> None:
    """Print a row for each policy."""
    warnings.simplefilter("ignore")
    generations, env = int(sys.argv[1]) if len(sys.argv) > 1 else 12, environment()
    none = np.zeros((env.action_space.shape[0], 1 + _SEEN))
    first = np.eye(1, 1 + _SEEN) * np.ones((len(none), 1))
    constant = learned(env, generations, 0.1 * first, 0.1 * first)
    # Around what it knows already: gains of all that it sees.
    linear = learned(env, generations, constant, np.full(none.shape, 0.03))
    policies = {"no commands": none, "constant commands, learned": constant, "linear policy, learned": linear}
    print("| policy | error: rms, most over 50 unseen seeds | reward | better than no commands |")
    print("| --- | --- | --- | --- |")
    worst = None
    for name, policy in policies.items():
        found = np.array([episode(env, policy, 1000 + seed) for seed in range(50)])
        worst = found[:, 1] if worst is None else worst
        better = int((found[:, 1] < worst).sum())
        error, reward = found[:, 1], float(found[:, 0].mean())
        print(f"| {name} | {error.mean():.1f}, {error.max():.1f}° | {reward:.2f} | {better} of 50 |")


if __name__ == "__main__":
    main()
