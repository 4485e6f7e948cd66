"""A closure type that is added as docs/contributing.md says: every solver, format, picture and command."""

import re

import mujoco
import numpy as np
import pytest
from command_line import run
from mechanisms import random_loop
from places import page
from tree_forces import tree_forces

import exo_pin as ep
from exo_pin.chain import TYPES, ClosedChain, ClosureType, read_closures, write_closures
from exo_pin.reaction import SPLITS
from exo_pin.view import ChainScene
from exo_pin.workspace import CRITERIA

BLOCKS = re.findall(r"```python\n(.*?)```", page("contributing"), re.S)


REGISTRIES = {"preloaded": SPLITS, "planar": TYPES, "reach": CRITERIA}


@pytest.fixture(autouse=True)
def _added():
    names = {}
    for block in BLOCKS:
        exec(block, names)
    yield
    for name, registry in REGISTRIES.items():
        del registry[name]


@pytest.fixture
def loop():
    named = random_loop("planar")
    return named, named.chain()


def test_an_added_closure_type_closes_moves_and_transmits(loop):
    named, chain = loop
    assert np.abs(chain.residual(named.q)).max() < 1e-14
    q = chain.close(named.q + 0.05)
    assert np.abs(chain.residual(q)).max() < 1e-12
    mobility = chain.mobility(q)
    assert (mobility.rows, mobility.rank, mobility.degrees_of_freedom) == (3, 3, 4)
    v = chain.project_velocity(q, np.linspace(-1.0, 1.0, 7))
    a = chain.project_acceleration(q, v, np.linspace(1.0, -1.0, 7))
    # It transmits no force along its plane, and no moment about the normal.
    solved = chain.inverse_dynamics(q, v, a)
    wrench = tree_forces(chain, q, v, a, solved.multipliers).closure_wrench("loop", frame="local")
    assert np.abs(wrench[[0, 1, 5]]).max() < 1e-12 * np.abs(wrench).max()


def test_an_added_closure_type_in_every_format(loop, tmp_path):
    named, chain = loop
    again = ClosedChain.from_urdf(chain.to_urdf(tmp_path))
    assert again.closures == chain.closures
    np.testing.assert_allclose(again.residual(named.q), chain.residual(named.q), atol=1e-12)
    write_closures(named.closures, tmp_path / "loop.toml")
    assert read_closures(tmp_path / "loop.toml") == named.closures
    with pytest.raises(ep.InvalidInput, match="SDF has no joint for the planar closure 'loop'"):
        chain.to_sdf(tmp_path, named.q)
    with pytest.raises(ep.InvalidInput, match="Pinocchio has no constraint for the planar closure 'loop'"):
        _ = chain.constraint_models


@pytest.mark.parametrize("linear", ["", "x", "yz", "xyz"])
@pytest.mark.parametrize("angular", ["", "xy", "cross", "xyz"])
def test_mujoco_allows_what_a_closure_of_any_rules_allows(linear, angular, tmp_path, monkeypatch):
    monkeypatch.setitem(TYPES, "planar", ClosureType("planar", linear, angular))
    named = random_loop("planar")
    chain, q = named.chain(), named.q
    model = mujoco.MjModel.from_xml_path(str(chain.to_mjcf(tmp_path, q)))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    rows = data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY
    J = np.zeros((data.nefc, model.nv))
    if mujoco.mj_isSparse(model):
        mujoco.mju_sparse2dense(J, data.efc_J, data.efc_J_rownnz, data.efc_J_rowadr, data.efc_J_colind)
    else:
        J[:] = data.efc_J[: J.size].reshape(J.shape)
    assert np.abs(data.efc_pos[rows]).max(initial=0.0) < 1e-11
    own = np.array([model.joint(name).dofadr[0] for name in list(chain.model.names)[1:]])
    helper = np.setdiff1d(np.arange(model.nv), own)
    J = J[rows]
    assert np.linalg.matrix_rank(J, tol=1e-8) == chain.mobility(q).rank + len(helper)
    # Every motion of ours goes on with some motion of the small body that stands for the closure.
    motions = chain.reduced_jacobian(q)
    gap = J[:, own] @ motions
    np.testing.assert_allclose(gap - J[:, helper] @ np.linalg.pinv(J[:, helper]) @ gap, 0.0, atol=1e-8)


def test_a_closure_that_a_format_cannot_write_is_never_written_as_another(tmp_path, monkeypatch):
    monkeypatch.setitem(TYPES, "planar", ClosureType("planar", "length", "xy"))
    named = random_loop("planar")
    with pytest.raises(ep.InvalidInput, match=r"MJCF has no equality for the planar closure 'loop'.*rigid, spherical"):
        named.chain().to_mjcf(tmp_path, named.q)
    assert not list(tmp_path.iterdir())
    for *rules, wrong in (("z", "tilted", "tilted"), ("xyzw", "", "xyzw"), ("x", "joints", "x")):
        with pytest.raises(ep.UnknownName, match=f"rule of closure type 'new' '{wrong}'"):
            ClosureType("new", *rules)


def test_an_added_closure_type_in_pictures_and_commands(loop, tmp_path, capsys):
    named, chain = loop
    scene = ChainScene(chain, q=named.q)
    assert any("loop: planar" in str(item) for item in scene._labels(named.q))
    status, out, _ = run(capsys, "mobility", str(chain.to_urdf(tmp_path)))
    assert status == 0
    assert "degrees of freedom" in out
