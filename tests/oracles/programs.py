"""Seeded questions for programs over limb and side forces, of every kind, with their equations by free bodies."""

import itertools

import numpy as np
from sockets import hanging
from wrists import random_mechanism, regular_poses

import exo_pin as ep

KINDS = ("pull", "range", "tight", "sides", "by_tension", "hard_cone", "soft_cone", "weights", "alone", "spherical")


class Problem:
    """A pose of a random wrist under a load: what is asked, and the equations and limits of its forces z = (f, g).

    The limbs that bear side forces are the first ``u``. Limbs and shoulder hold the moment ``moment``, and F_s is
    ``shoulder`` + ``effect`` z.
    """

    def __init__(self, rng, kind, n=None, u=None, faces=None, reachable=None):
        n = int(rng.integers(3, 8)) if n is None else n
        most = n if kind in ("alone", "by_tension") else int(rng.integers(0, 4))
        u = min(n, most if u is None else u)
        self.kind, self.n, self.u = kind, n, u
        while True:
            mechanism = random_mechanism(rng, n, ["UPU"] * u + ["SPS"] * (n - u)).replace(gravity=[0.0, 0.0, 0.0])
            if len(poses := regular_poses(mechanism, rng, 1, margin=0.03)):
                break
        self.exo, self.pose = ep.ShoulderExo.from_mechanism(mechanism), poses[0]
        a, b = self.exo.geometry.base_points, self.exo.geometry.platform_points @ self.pose.as_matrix().T
        s = (b - a) / np.linalg.norm(b - a, axis=1)[:, None]
        X = -np.cross(a, b) / np.linalg.norm(np.cross(a, b), axis=1)[:, None]
        self.radius = float(np.linalg.norm(b, axis=1).max())
        self.arms = np.hstack([np.cross(b, s).T, np.zeros((3, u))])
        self.effect = np.hstack([s.T, X[:u].T])
        self._limits(rng, reachable)
        self._question(rng, faces)
        f = rng.uniform(0.0, 1.0, n) * np.minimum(50.0, self.f_high - self.f_low) + self.f_low
        f = f if np.isfinite(f).all() else rng.uniform(0.0, 50.0, n)
        reachable = rng.random() < 0.7 if reachable is None else reachable
        z = np.append(f, 30.0 * rng.normal(size=u) if kind == "alone" else np.zeros(u))
        self.moment = self.arms @ z if reachable else rng.normal(size=3) * 10 ** rng.uniform(-1, 1.5)
        self.shoulder = 40.0 * rng.normal(size=3)
        if reachable and kind == "alone":
            self.shoulder = -self.effect @ z
        if reachable and kind == "hard_cone":
            # Let these same forces put F_s well inside the socket.
            axis = self.cone.axes(self.exo.side, self.pose)[0]
            self.shoulder = axis * rng.uniform(50.0, 200.0) - self.effect @ z

    def _limits(self, rng, reachable):
        n, u, kind = self.n, self.u, self.kind
        self.f_low, self.f_high = np.zeros(n), np.full(n, np.inf)
        if kind not in ("pull", "by_tension") and rng.random() < 0.7:
            self.f_low = rng.uniform(0, 20, n) * rng.integers(0, 2, n)
            self.f_high = self.f_low + rng.uniform(5, 400, n)
        if kind == "tight":
            self.f_high = self.f_low + rng.uniform(0, 30, n) * rng.integers(0, 2, n)
        size = 10 ** rng.uniform(-1, 2)
        self.g_low, self.g_high = -size * rng.random(u), size * rng.random(u)
        if kind in ("alone", "by_tension"):
            self.g_low, self.g_high = np.full(u, -np.inf), np.full(u, np.inf)
        if kind == "spherical":
            self.g_low = self.g_high = np.zeros(u)

    def _question(self, rng, faces):
        self.cone, self.goal, self.tension = None, np.eye(3), 0.0
        self.options = {"split": {"alone": "standalone"}.get(self.kind, "minimal")}
        if self.kind in ("hard_cone", "soft_cone"):
            penalty = None if self.kind == "hard_cone" else 10 ** rng.uniform(-2, 3)
            muscles = float(rng.choice([0.0, 50.0, 500.0]))
            self.cone = hanging(faces=int(faces or rng.integers(4, 33)), muscle_compression=muscles, penalty=penalty)
            self.options["cone"] = self.cone
            self.N, self.h = self.cone.half_spaces(self.exo.side, self.pose)
        if self.kind == "weights":
            self.tension = float(rng.choice([0.0, 1e-4, 0.01]))
            weights = ep.Weights(10 ** rng.uniform(-1, 1), 10 ** rng.uniform(-1, 1), self.tension, hanging())
            axes = hanging().axes(self.exo.side, self.pose)
            self.goal = np.sqrt([weights.compression, weights.shear, weights.shear])[:, None] * axes
            self.options["weights"] = weights
        if self.kind == "spherical":
            self.options["split"] = "spherical"
        if self.kind in ("spherical", "alone"):
            self.goal = None
        elif self.kind == "by_tension":
            self.options["constraint_bounds"] = "actuator"
        else:
            rest = np.zeros(self.n - self.u)
            self.options["constraint_bounds"] = np.append(self.g_low, rest), np.append(self.g_high, rest)

    @property
    def low(self):
        return np.append(self.f_low, self.g_low)

    @property
    def high(self):
        return np.append(self.f_high, self.g_high)

    @property
    def scale(self):
        """Size of load and of the tensions of least norm that balance it, N."""
        f = np.linalg.lstsq(self.arms / self.radius, self.moment / self.radius, rcond=None)[0]
        return float(max(np.abs(self.shoulder).max(), np.abs(f).max(), np.maximum(self.low, -self.high).max(), 1e-3))

    def answer(self, size=1.0, **changes):
        """The package's answer, with all loads times ``size``."""
        load = ep.Load(-size * self.shoulder, size * self.moment)
        return self.exo.reaction(self.pose, load=load, limits=(self.f_low, self.f_high), **self.options | changes)

    def forces(self, answer):
        """z of an answer."""
        return np.append(answer.actuator_forces, answer.constraint_forces[: self.u])

    def force(self, z):
        return self.shoulder + self.effect @ z

    def side_rows(self):
        """Rows of |g_i| <= f_i, for limbs that pull."""
        if self.kind != "by_tension":
            return np.zeros((0, self.n + self.u))
        return np.array(
            [np.append(-np.eye(self.n)[i], sign * np.eye(self.u)[i]) for i in range(self.u) for sign in (1, -1)]
        )

    def cost(self, z):
        """What the answer makes small, without a soft cone."""
        if self.goal is None:
            return float(z @ z)
        return float(((self.goal @ self.force(z)) ** 2).sum() + self.tension * (z[: self.n] @ z[: self.n]))


def room_left(arms, moment, low, high):
    """Distance of a moment from the nearest face of all that tensions give; the arms of two limbs span a face."""
    left = np.inf
    for i, k in itertools.combinations(range(arms.shape[1]), 2):
        normal = np.cross(arms[:, i], arms[:, k])
        for face in (normal, -normal):
            gains = np.delete(face @ arms, (i, k))
            ends = np.where(gains > 0, np.delete(high, (i, k)), np.delete(low, (i, k)))
            left = min(left, (gains @ ends - face @ moment) / np.linalg.norm(face))
    return left
