"""Seeded calls of the public names with spoiled arguments."""

import numpy as np
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.core.errors.base import echo
from exo_pin.load_case import Movement

#: A list that Python cannot print.
NESTED: list = []
for _ in range(100_000):
    NESTED = [NESTED]


class Liar:
    """An actuator that answers anything."""

    def __init__(self, answer):
        self.answer = answer

    def force_limits(self, length):
        return self.answer

    def pressure_for(self, force, length):
        return self.answer

    def stiffness(self, length, pressure):
        return self.answer


def junk(rng):
    """Something that no argument can be, or nearly none."""
    pick = int(rng.integers(27))
    size = tuple(rng.integers(0, 5, size=int(rng.integers(0, 4))))
    return (
        None,
        "",
        "spherical",
        b"x",
        {},
        [],
        (),
        [[1, 2], [3]],
        object(),
        1j,
        True,
        np.nan,
        np.inf,
        -np.inf,
        1e300,
        -1e300,
        5e-324,
        -1,
        np.full(size, np.nan),
        np.full(size, np.inf),
        rng.normal(size=size) * 10.0 ** rng.integers(-300, 300),
        np.array(["a", "b"]),
        np.array([None, 1.0], dtype=object),
        np.diag([1.0, 1.0, -1.0]),
        10**5000,
        NESTED,
        "\x1b[2J" + "x" * 5000,
    )[pick]


def spoiled(rng, value):
    """A good array with one thing wrong."""
    array = np.array(value, dtype=float)
    kind = int(rng.integers(7))
    if kind == 0:
        array.flat[int(rng.integers(array.size))] = rng.choice([np.nan, np.inf, -np.inf])
    elif kind == 1:
        array = array * 10.0 ** rng.choice([-320, -200, -20, 20, 200, 300])
    elif kind == 2:
        array = array[..., :-1] if array.ndim else array
    elif kind == 3:
        array = np.concatenate([array, array], axis=-1) if array.ndim else array
    elif kind == 4:
        array = array[:0] if array.ndim else array
    elif kind == 5:
        array = -array
    else:
        array = np.zeros_like(array)
    return array


def either(rng, value):
    return junk(rng) if rng.random() < 0.5 else spoiled(rng, value)


def poses(rng):
    """Poses, mostly good ones, some at or near the singular surface, some empty."""
    kind = int(rng.integers(6))
    if kind == 0:
        return Rotation.identity(0)
    if kind == 1:
        return ep.thesis_rotation([90.0, 90.0 + 10.0 ** rng.uniform(-14, -1)], 0, 0, degrees=True)
    if kind == 2:
        return Rotation.from_quat(Rotation.random(2, rng=rng).as_quat().reshape(2, 1, 4))
    return Rotation.random(int(rng.integers(1, 3)), rng=rng)


EXO = ep.load("prototype").worn_by(ep.Arm.from_anthropometry(1.75, 75, "male"))

G = EXO.geometry

FOUR = EXO.replace(
    geometry=ep.WristGeometry(
        np.vstack([G.base_points, [0.1, -0.1, -0.1]]), np.vstack([G.platform_points, [0.0, -0.08, -0.2]])
    ),
    limbs=(ep.Limb("UPU"), ep.Limb("SPS")) * 2,
)


def some_exo(rng):
    return EXO if rng.random() < 0.5 else FOUR


def with_one_bad(rng, good):
    """Keyword arguments of which one is spoiled."""
    name = list(good)[int(rng.integers(len(good)))]
    return {**good, name: either(rng, good[name]) if not isinstance(good[name], str) else junk(rng)}


def geometry(rng):
    good = {"base_points": G.base_points, "platform_points": G.platform_points, "base_axis": [0, 1, 0]}
    return ep.WristGeometry(**with_one_bad(rng, good))


def circles(rng):
    good = {"r_A": 0.1, "r_B": 0.1, "h_A": 0.05, "h_B": 0.2, "alpha_A": [0.5, 1.0, 2.0], "alpha_B": [0.5, 1.0, 2.0]}
    return ep.WristGeometry.from_circles(**with_one_bad(rng, good))


def arm(rng):
    good = {"mass": 3.0, "centre_of_mass": [0, 0, -0.3], "inertia": np.diag([0.1, 0.1, 0.01])}
    return ep.Arm(**with_one_bad(rng, good))


def anthropometry(rng):
    good = {"height": 1.7, "mass": 70.0, "sex": "male", "elbow_flexion": 0.3, "payload": 1.0}
    return ep.Arm.from_anthropometry(**with_one_bad(rng, good))


def angles(rng):
    function = ep.shoulder_rotation if rng.random() < 0.5 else ep.thesis_rotation
    values = [np.array([0.1, 0.2])] * 3
    values[int(rng.integers(3))] = either(rng, values[0])
    return function(*values)


def load(rng):
    good = {"force": [0, 0, -10.0], "moment": [0, 0, 1.0], "at": [0, 0, -0.3], "frame": "base"}
    given = ep.Load(**with_one_bad(rng, good))
    return some_exo(rng).reaction(poses(rng), load=given, split=str(rng.choice(["spherical", "minimal"])))


def motion(rng):
    good = {"angular_velocity": np.ones((2, 3)), "angular_acceleration": np.ones((2, 3))}
    return some_exo(rng).reaction(poses(rng), motion=ep.Motion(**with_one_bad(rng, good)))


def orientation(rng):
    return some_exo(rng).reaction(junk(rng))


def side_bounds(rng):
    good = (-10.0 * np.ones(3), 10.0 * np.ones(3))
    pair = (either(rng, good[0]), good[1]) if rng.random() < 0.5 else (good[0], either(rng, good[1]))
    return EXO.reaction(
        poses(rng), split="minimal", constraint_bounds=junk(rng) if rng.random() < 0.3 else pair, limits="none"
    )


def limb_bounds(rng):
    exo = some_exo(rng)
    good = (np.zeros(exo.mechanism.limb_count), 300.0 * np.ones(exo.mechanism.limb_count))
    pair = (either(rng, good[0]), good[1]) if rng.random() < 0.5 else (good[0], either(rng, good[1]))
    bounds = junk(rng) if rng.random() < 0.3 else pair
    return exo.reaction(poses(rng), split=str(rng.choice(["spherical", "minimal"])), limits=bounds)


def actuators(rng):
    exo = some_exo(rng)
    answer = (either(rng, np.zeros(2)), either(rng, np.ones(2))) if rng.random() < 0.7 else junk(rng)
    liars = [Liar(answer)] * int(rng.integers(0, 5))
    return exo.reaction(poses(rng), limits=liars)


def cone(rng):
    good = {
        "superior": 0.6,
        "anterior": 0.3,
        "faces": 8,
        "approximation": "inner",
        "muscle_compression": 100.0,
        "penalty": 1.0,
    }
    angles = dict.fromkeys(("internal_rotation", "upward_rotation", "tilt", "retroversion", "inclination"), 0.1)
    turn = ep.glenoid_orientation(**with_one_bad(rng, angles)) if rng.random() < 0.5 else Rotation.identity()
    return EXO.reaction(poses(rng), cone=ep.GlenoidCone(orientation=turn, **with_one_bad(rng, good)))


def weights(rng):
    given = ep.Weights(**with_one_bad(rng, {"shear": 1.0, "compression": 1.0, "tension": 0.1}))
    return FOUR.reaction(poses(rng), split="minimal", weights=given)


def options(rng):
    name = str(rng.choice(["split", "cone", "weights", "constraint_bounds", "motion", "load"]))
    return some_exo(rng).reaction(poses(rng), **{name: junk(rng)})


def limbs(rng):
    return EXO.replace(limbs=[junk(rng)] * int(rng.integers(0, 5)))


def fields(rng):
    name = str(rng.choice(["gravity", "side", "arm", "geometry", "limbs", "shoulder", "radius"]))
    return EXO.replace(**{name: junk(rng)})


def movement(rng):
    t, series = np.linspace(0, 1, 14), ep.shoulder_rotation(np.linspace(0, 1, 14), 0.2, 0)
    good = {"times": t, "sensor_noise": 0.01}
    given = with_one_bad(rng, good)
    if rng.random() < 0.2:
        return Movement.from_samples(t, junk(rng))
    return Movement.from_samples(given["times"], series, sensor_noise=given["sensor_noise"])


def follow(rng):
    return EXO.follow(junk(rng))


def sweep(rng):
    name = str(rng.choice(["r_A", "alpha", "alpha_A[2]", "gravity", "person", "payload", "limbs", "limb_kind", "x"]))
    return ep.sweep(EXO, {name: [junk(rng)]}, poses(rng), payload_at=junk(rng) if rng.random() < 0.3 else [0, 0, -0.5])


def design_files(rng):
    return ep.load(echo(junk(rng))[:40])


MAKERS = (
    geometry,
    circles,
    arm,
    anthropometry,
    angles,
    load,
    motion,
    orientation,
    side_bounds,
    limb_bounds,
    actuators,
    cone,
    weights,
    options,
    limbs,
    fields,
    movement,
    follow,
    sweep,
    design_files,
)
