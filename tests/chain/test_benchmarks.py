"""The robots and rows of the benchmarks of chains, without the timing."""

import importlib
import sys
from pathlib import Path

import numpy as np
import pytest

FOLDER = Path(__file__).resolve().parents[2] / "benchmarks"


@pytest.fixture
def benchmark(monkeypatch):
    """Import a module of the benchmarks."""
    monkeypatch.setattr(sys, "path", [str(FOLDER), *sys.path])
    monkeypatch.setenv("EXO_PIN_COMPILE", "auto")
    return importlib.import_module


def test_the_robots_beside_the_peer_load_and_close(benchmark):
    """A five-bar and a delta whose loops close by rigid closures, as the peer needs them."""
    peer = benchmark("peer")
    for robot in (peer.five_bar_with_tip(), peer.delta_of_rods()):
        name, urdf, chain, q = robot
        given = peer.problem(name, urdf, chain)
        assert len(given["closures"]) == len(chain.closures)
        assert np.abs(chain.residual(q)).max() < 1e-12


def test_plain_pinocchio_and_mujoco_solve_the_same_problem(benchmark):
    """The rows of dynamics.py: least squares have the efforts of inverse_dynamics where they are unique."""
    dynamics, peer = benchmark("dynamics"), benchmark("peer")
    name, _, chain, q = peer.five_bar_with_tip()
    motions = dynamics.states(chain, q)[:3]
    extra = {name: (dynamics.plain_pinocchio(chain), dynamics.in_mujoco(chain, q))}
    answers = dynamics.own([(name, "", chain, q)], {name: motions}, extra)
    plain, mine = (next(a for a in answers if a["solver"] == label) for label in ("Pinocchio, lstsq", "exo_pin"))
    np.testing.assert_allclose(plain["efforts"], mine["efforts"], atol=1e-12)
    assert max(*plain["residuals"], *mine["residuals"]) < 1e-12


def test_bare_pinocchio_has_the_accelerations_of_forward_dynamics(benchmark):
    """The first rows of chain_speed.py, and of Cassie, whose hinges are two points each."""
    speed, large = benchmark("chain_speed"), benchmark("large_chains")
    chains = [large.cassies(1), large.ladder(3)]
    if (real := large.cassie()) is not None:
        chains.append(real)
    for chain in chains:
        q, v, tau = large.state_of(chain)
        expected = chain.forward_dynamics(q, v, tau).a
        np.testing.assert_allclose(speed.raw(chain, q, v, tau)(), expected, atol=1e-9 * np.abs(expected).max())
