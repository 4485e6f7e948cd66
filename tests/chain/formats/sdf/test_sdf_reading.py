"""Chains that were read from SDF against Drake's reading, and robots with loops.

A part runs in every run of the tests, all of it with ``pytest -m "not long"``.
"""

import warnings

import numpy as np
import pinocchio as pin
import pytest
from scenes import human_urdf, needs_human
from sdf_arm import ARM
from sdf_mutations import mutated_sdf
from sdf_oracle import DrakeSdf, assert_is_drakes
from sdf_robots import LEG, random_sdf

from exo_pin import FileFormatError
from exo_pin.chain import ClosedChain

SEEDS = [pytest.param(seed, marks=() if seed < 25 else pytest.mark.full) for seed in range(400)]


#: The joints of Cassie's motors.
MOTORS = [f"{side}-{name}-op" for side in ("left", "right") for name in ("roll", "yaw", "pitch", "knee", "foot")]


def cassie(variant="cassie_v2"):
    return human_urdf().parents[2] / "cassie_description" / "robots" / f"{variant}.sdf"


@pytest.mark.parametrize("seed", SEEDS)
def test_random_robots_are_drakes(seed):
    assert_is_drakes(random_sdf(seed), seed)


@needs_human
@pytest.mark.parametrize("variant", ["cassie_v2", "cassie_reduced", "cassie_simple", "cassie_wo_gearbox_spring"])
def test_cassie_is_drakes(variant):
    chain = assert_is_drakes(cassie(variant).read_text(), 0)
    assert len(chain.closures) == 4
    assert np.abs(chain.residual(chain.neutral())).max() < 1e-12


@needs_human
def test_cassies_mobility_is_that_by_hand():
    # 23 links, 22 hinges and 4 balls: 6 23 - 5 22 - 3 4 = 16 by Grübler's count. The crank, the rod and the foot of
    # each leg turn about parallel axes: their loop lies in a plane, across which the rod's ball is redundant: 18.
    chain = ClosedChain.from_sdf(cassie())
    assert chain.model.nv == 32
    q = chain.close(pin.integrate(chain.model, chain.neutral(), np.random.default_rng(0).uniform(-0.05, 0.05, 32)))
    for there in (chain.neutral(), q):
        found = chain.mobility(there, actuated=())
        assert (found.rows, found.rank, found.degrees_of_freedom, found.redundant) == (16, 14, 18, 2)
        assert dict(found.redundant_closures) == {"left-plantar-foot-joint": 1, "right-plantar-foot-joint": 1}
        assert found.kinds == ()


def assert_moves(chain, motors, size):
    """Inverse after forward dynamics gives the efforts back, and a motion keeps its energy but for the damping."""
    rng = np.random.default_rng(0)
    q = chain.close(pin.integrate(chain.model, chain.neutral(), rng.uniform(-size, size, chain.model.nv)))
    v = chain.project_velocity(q, 0.3 * rng.normal(size=chain.model.nv))
    tau = np.zeros(chain.model.nv)
    tau[chain.velocity_indices(motors)] = rng.normal(size=len(motors))
    motion = chain.forward_dynamics(q, v, tau)
    forces = chain.inverse_dynamics(q, v, motion.a, actuated=motors)
    unique = forces.effort_is_unique
    np.testing.assert_allclose(forces.tau[unique], tau[unique], rtol=0, atol=1e-8)
    assert forces.residual < 1e-8
    assert unique.all() or forces.undetermined
    # Where there are more motors than the loops leave freedoms for, other efforts make the same motion.
    again = chain.forward_dynamics(q, v, forces.tau).a
    np.testing.assert_allclose(again, motion.a, rtol=0, atol=1e-8 * np.abs(motion.a).max())
    found = chain.simulate(q, v, [0.0, 0.02, 0.04])
    assert found.dissipated[-1] > 0.0
    total = found.energy + found.dissipated
    np.testing.assert_allclose(total, total[0], rtol=0, atol=1e-7 * np.abs(found.energy).max())
    assert found.opening.max() < 1e-9


@needs_human
@pytest.mark.parametrize(
    "variant",
    ["cassie_v2", *(pytest.param(f"cassie_{name}", marks=pytest.mark.full) for name in ("reduced", "simple"))],
)
def test_cassie_moves(variant):
    chain = ClosedChain.from_sdf(cassie(variant))
    # Of the others' rows none agree by the digits: they are read as they stand.
    assert variant == "cassie_v2" or (chain.description.tolerance, chain.description.rounding > 0.0) == (0.0, True)
    assert_moves(chain, [name for name in MOTORS if name in list(chain.model.names)], 0.02)


def test_the_choice_of_the_closing_joints_changes_no_motion():
    ball = "<dynamics><damping>0.01</damping></dynamics>"
    hinge = "<pose>0.02 0 -0.05 0 0 0</pose><axis><xyz>0 1 0</xyz>"
    assert ball in LEG
    assert hinge in LEG
    # Bare, both balls close. With a damper in one of them and a limit on the hinge of its loop, neither joint can be a
    # closure: the ball gets a body of its own without mass, held by a rigid closure.
    limited = LEG.replace(hinge, f"{hinge}<limit><lower>-2</lower><upper>2</upper></limit>")
    expected = {
        LEG: {"rod_foot": "spherical", "strut_shin": "revolute"},
        LEG.replace(ball, ""): {"rod_foot": "spherical", "strut_pelvis": "spherical"},
        limited: {"rod_foot": "spherical", "strut_pelvis_closure": "rigid"},
    }
    motions = []
    for text, closing in expected.items():
        chain = ClosedChain.from_sdf(text)
        assert {closure.name: closure.type for closure in chain.closures} == closing
        q = chain.neutral()
        assert np.abs(chain.residual(q)).max() < 1e-14
        assert chain.mobility(q, actuated=()).degrees_of_freedom == 9
        a = chain.forward_dynamics(q, None, {"hip": 1.0, "knee": 2.0, "drive": -0.5}).a
        motions.append([a[chain.velocity_slice(name)][0] for name in ("hip", "knee", "ankle", "drive", "slide")])
    np.testing.assert_allclose(motions[1:], [motions[0]] * 2, rtol=0, atol=1e-9 * np.abs(motions).max())
    assert chain.model.damping[chain.velocity_slice("strut_pelvis")].tolist() == [0.01] * 3


def read(old="", new="", text=ARM):
    assert old in text
    return ClosedChain.from_sdf(text.replace(old, new, 1) if old else text)


@pytest.mark.parametrize(
    ("geometry", "mass", "moments"),
    [
        ("<box><size>1 2 3</size></box>", 6000.0, np.array([13, 10, 5]) * 500.0),
        ("<sphere><radius>0.5</radius></sphere>", 1000 * np.pi / 6, np.full(3, 100 * np.pi / 6)),
        (
            "<cylinder><radius>0.5</radius><length>2</length></cylinder>",
            500 * np.pi,
            np.array([0.25 / 4 + 4 / 12, 0.25 / 4 + 4 / 12, 0.125]) * 500 * np.pi,
        ),
        ("<ellipsoid><radii>1 2 3</radii></ellipsoid>", 8000 * np.pi, np.array([13, 10, 5]) * 1600 * np.pi),
    ],
)
def test_inertia_of_the_collision_shapes(geometry, mass, moments):
    shape = f'<collision name="c"><pose>1 0 0 0 0 0</pose><geometry>{geometry}</geometry></collision>'
    for inertial, share in (
        ('<inertial auto="true"/>', 1.0), ('<inertial auto="true"><density>500</density></inertial>', 0.5),
        ('<inertial auto="true"><mass>3</mass></inertial>', 3.0 / mass),
    ):  # fmt: skip
        link = f'<link name="base"/><link name="core">{shape}{inertial}</link>'
        own = read('<link name="base"/>', link).model.inertias[-1]
        assert own.mass == pytest.approx(share * mass)
        np.testing.assert_allclose(own.lever, [1, 0, 0])
        np.testing.assert_allclose(own.inertia, share * np.diag(moments), rtol=1e-12, atol=1e-9)


@pytest.mark.parametrize(
    "seeds", [range(60), *(pytest.param(range(k, k + 200), marks=pytest.mark.full) for k in range(60, 2000, 200))]
)
def test_a_mutated_file_means_what_drake_reads_or_is_refused(seeds):
    read = 0
    for seed in seeds:
        text = mutated_sdf(seed)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)
            try:
                chain = ClosedChain.from_sdf(text)
            except FileFormatError:
                continue
        read += 1
        model = chain.model
        names = [frame.name.split("::")[-1] for frame in model.frames]
        if len(set(names)) < len(names):
            continue  # Drake's names cannot be told apart
        if not model.nv or any(closure.name.endswith("_closure") for closure in chain.closures):
            continue
        try:
            drake = DrakeSdf(text, chain)
        except RuntimeError:
            continue  # Drake refuses some that have a meaning, as a ball joint from the child to the parent
        q = pin.integrate(model, chain.neutral(), np.random.default_rng(seed).uniform(-1.0, 1.0, model.nv))
        M, _ = drake.mass_and_gravity(q)
        upper = np.triu(np.reshape(pin.crba(model, model.createData(), q), (model.nv, model.nv)))
        np.testing.assert_allclose(
            upper + np.triu(upper, 1).T, M, rtol=0, atol=1e-9 * np.abs(M).max(), err_msg=str(seed)
        )
    assert read > len(seeds) / 5
