"""A Stewart platform as Gazebo's users write it: read, closed, compared with Drake and MuJoCo, written, read again."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from mujoco_exact import ExactMujoco
from sdf_oracle import assert_is_drakes
from stewart_sdf import stewart

from exo_pin.chain import ClosedChain

#: The kinds of the model, and their freedoms beside the six of a base that nothing holds.
KINDS = {
    "published": ({"moments": 0.0}, 6),
    "inertia": ({"moments": 1e-3, "damping": 0.3}, 6),
    "universal": ({"lower": "universal", "moments": 1e-3, "held": True}, 6),
    "no limits": ({"lower": "universal", "moments": 1e-3, "held": True, "limits": False, "damping": 0.3}, 6),
    "hinges": ({"upper": "hinges", "moments": 1e-3, "held": True, "damping": 0.3}, None),
    "universals": ({"lower": "universal", "upper": "universal", "moments": 1e-3, "held": True}, 3),
}
PISTONS = [f"piston{leg}_prismatic_joint" for leg in range(6)]


def near(chain, size=0.05, seed=0):
    """A closed configuration and a velocity beside the file's."""
    rng = np.random.default_rng(seed)
    q = chain.close(pin.integrate(chain.model, chain.neutral(), rng.uniform(-size, size, chain.model.nv)))
    return q, chain.project_velocity(q, rng.normal(size=chain.model.nv))


@pytest.mark.parametrize("name", KINDS)
def test_its_loops_close_and_its_mobility_is_that_by_hand(name):
    """Each leg of two universal joints and a slide has five freedoms of six, one of two and a ball has six."""
    arguments, freedoms = KINDS[name]
    chain = ClosedChain.from_sdf(stewart(**arguments))
    assert np.abs(chain.residual(chain.neutral())).max() < 1e-14
    q, _ = near(chain)
    assert np.abs(chain.residual(q)).max() < 1e-12
    base = 0 if arguments.get("held") else 6
    there = chain.mobility(q, actuated=())
    if freedoms is None:
        # The six couples that hold the pistons against turning are parallel as drawn, about the platform's normal.
        drawn = chain.mobility(chain.neutral(), actuated=())
        assert drawn.degrees_of_freedom == 5
        assert "constraint" in drawn.kinds
        assert there.degrees_of_freedom < 5
        return
    assert there.degrees_of_freedom == base + freedoms
    assert there.kinds == ()
    assert np.linalg.matrix_rank(chain.constraint_jacobian(q), tol=1e-8) == there.rank
    # The pistons drive it.
    driven = chain.mobility(q, actuated=PISTONS[:freedoms], frame="platform_link")
    assert driven.locked.degrees_of_freedom == base


@pytest.mark.parametrize("name", ["published", "inertia", "universal", "no limits"])
def test_places_and_masses_are_drakes(name):
    """The tree, joints that close loops taken out: places of the links, mass matrix, weight, limits and damping."""
    assert_is_drakes(stewart(**KINDS[name][0]), 0)


@pytest.mark.parametrize("name", KINDS)
def test_it_comes_back_from_mjcf_and_moves_as_in_mujoco(name, tmp_path):
    """Accelerations of MuJoCo's matrices, its equalities solved exactly, and of the file that is read again."""
    arguments = KINDS[name][0]
    chain = ClosedChain.from_sdf(stewart(**arguments))
    q, v = near(chain)
    path = chain.to_mjcf(tmp_path, q)
    again = ClosedChain.from_mjcf(path)
    there = again.close(again.reference_configuration("closed"))
    for link in ("platform_link", "piston3_shaft_link", "base_link"):
        np.testing.assert_allclose(
            again.placement(there, link).homogeneous, chain.placement(q, link).homogeneous, atol=1e-9
        )
    one, other = chain.mobility(q, actuated=()), again.mobility(there, actuated=())
    assert one.degrees_of_freedom == other.degrees_of_freedom
    text = path.read_text()
    assert ("a millionth was added" in text) == (not arguments["moments"] or arguments.get("upper", "ball") != "ball")
    if not arguments["moments"]:
        return
    tau = dict(zip(PISTONS, [10.0, -5.0, 3.0, 8.0, -2.0, 4.0], strict=True))
    motion = chain.forward_dynamics(q, v, tau)
    exact = ExactMujoco(mujoco.MjModel.from_xml_path(str(path)), chain)
    qpos = exact.qpos_of(q)
    T, rate = exact.velocity_map(qpos, v)
    forces = np.zeros(chain.model.nv)
    forces[chain.velocity_indices(PISTONS)] = list(tau.values())
    wanted = exact.acceleration(qpos, T @ v, np.linalg.solve(T.T, forces))
    # The ends of joints that close loops have a millionth of a link's mass.
    error = np.abs(T @ motion.a + rate @ v - wanted).max() / np.abs(wanted).max()
    assert error < (1e-4 if arguments.get("upper", "ball") != "ball" else 1e-8)
