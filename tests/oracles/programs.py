"""Seeded poses for the programs over limb and side forces, of every kind, without a mechanism behind them."""

import itertools

import numpy as np
from scipy.spatial.transform import Rotation
from sockets import hanging

from exo_pin.reaction import GlenoidCone, Weights
from exo_pin.reaction.splits.limb_and_side_forces import Pose, Socket
from exo_pin.wrist.forces.affine_state import AffineState

KINDS = ("pull", "range", "tight", "sides", "by_tension", "hard_cone", "soft_cone", "weights", "alone", "spherical")


def random_pose(rng, kind, n=None, faces=None, reachable=None):
    """A pose of one kind; ``reachable`` moments come from admissible forces, others are drawn blindly."""
    n = int(rng.integers(3, 8)) if n is None else n
    u = n if kind in ("alone", "by_tension") else int(rng.integers(0, 4))
    upu = np.sort(rng.choice(n, size=min(u, n), replace=False))
    b, s = 0.2 * rng.normal(size=(n, 3)), rng.normal(size=(n, 3))
    s /= np.linalg.norm(s, axis=1, keepdims=True)
    if rng.random() < 0.1:
        s[1] = s[0] + 10 ** rng.uniform(-8, -2) * rng.normal(size=3)  # two limbs side by side
        b[1] = b[0]
    X = np.cross(b, s)
    X /= np.linalg.norm(X, axis=1, keepdims=True)
    f_low, f_high = np.zeros(n), np.full(n, np.inf)
    if kind != "pull" and kind != "by_tension" and rng.random() < 0.7:
        f_low = rng.uniform(0, 20, n) * rng.integers(0, 2, n)
        f_high = f_low + rng.uniform(5, 400, n)
    if kind == "tight":
        f_high = f_low + rng.uniform(0, 30, n) * rng.integers(0, 2, n)
    size = 10 ** rng.uniform(-1, 2)
    g_low, g_high = -size * rng.random(upu.size), size * rng.random(upu.size)
    if kind in ("alone", "by_tension"):
        g_low, g_high = np.full(upu.size, -np.inf), np.full(upu.size, np.inf)
    if kind == "spherical":
        g_low = g_high = np.zeros(upu.size)
    socket = None
    if kind in ("hard_cone", "soft_cone"):
        cone = GlenoidCone(
            orientation=Rotation.from_rotvec(0.3 * rng.normal(size=3)),
            faces=int(faces or rng.integers(4, 33)),
            muscle_compression=float(rng.choice([0.0, 50.0, 500.0])),
            penalty=None if kind == "hard_cone" else 10 ** rng.uniform(-2, 3),
        )
        socket = Socket.of(cone, "left", Rotation.identity()).row(0)
    goal, tension = np.eye(3), 0.0
    if kind == "weights":
        weights = Weights(
            10 ** rng.uniform(-1, 1), 10 ** rng.uniform(-1, 1), float(rng.choice([0.0, 1e-4, 0.01])), hanging()
        )
        goal, tension = weights.root("left", Rotation.identity()), weights.tension
    if kind in ("spherical", "alone"):
        goal = None
    moment_of_f = -np.cross(b, s).T
    f = rng.uniform(0, 1, n) * np.minimum(50, f_high - f_low) + f_low
    reachable = rng.random() < 0.7 if reachable is None else reachable
    moment = moment_of_f @ f if reachable else rng.normal(size=3) * 10 ** rng.uniform(-1, 1.5)
    shoulder = rng.normal(size=3) * 40
    if kind == "hard_cone" and reachable:
        # Let these same forces put F_s well inside the socket.
        shoulder = cone.axes()[0] * rng.uniform(50, 200) - s.T @ f
    of_f = np.concatenate([-s, -np.cross(b, s)], axis=1)
    of_g = np.zeros((n, 6))
    of_g[upu, :3] = -X[upu]
    if kind == "alone" and reachable:
        shoulder = -s.T @ f - X.T @ (rng.normal(size=n) * 30)
    none = np.zeros((n, 6))
    state = AffineState.of_closures(none, of_f, of_g, none, np.concatenate([shoulder, moment]))
    radius = float(np.linalg.norm(b, axis=1).max())
    return Pose(
        state, radius, f_low, f_high, socket, g_low, g_high, upu, kind == "by_tension", goal, tension, kind == "alone"
    )


def shoulder_force(pose, f, g):
    """F_s of chosen forces."""
    return pose.state.shoulder + pose.state.shoulder_of_f @ f + pose.state.shoulder_of_g @ g


def distance_to_cone(pose, force):
    """Squared distance of F_s from the polyhedral cone, by its own small program (Dykstra would do as well)."""
    from scipy.optimize import minimize

    N, h = pose.socket.N, pose.socket.h
    start = np.linalg.lstsq(N, np.minimum(N @ force, h), rcond=None)[0]
    answer = minimize(
        lambda x: ((x - force) ** 2).sum(),
        start,
        jac=lambda x: 2 * (x - force),
        constraints={"type": "ineq", "fun": lambda x: h - N @ x, "jac": lambda x: -N},
        method="SLSQP",
        options={"ftol": 1e-15, "maxiter": 500},
    )
    return float(answer.fun)


def cost(pose, f, g):
    """What the program makes small, without a soft cone: computed from F_s and not from its matrices."""
    force = shoulder_force(pose, f, g)
    if pose.goal is None:
        return float(f @ f + g[pose.upu] @ g[pose.upu])
    return float(((pose.goal @ force) ** 2).sum() + pose.tension * (f @ f))


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
