"""Turns of a search, limbs that go through O, limits of muscles, and bars that nobody asked for."""

import importlib
import inspect
import pkgutil

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from wrists import heavy_limbs, random_mechanism

from exo_pin import reaction
from exo_pin.load_case.pose_stacks import as_query
from exo_pin.reaction.holding.least_held_forces import _weight_of_limbs, least_held_forces
from exo_pin.reaction.holding.remedy import _shorter, _shortest, _spread
from exo_pin.wrist.forces.limb_inertia import limb_loads

INF = np.inf


def test_turns_that_are_refined_are_short_and_apart():
    up, side = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
    near = np.array([0.1, 0.0, 1.0]) / np.sqrt(1.01)
    turns = np.array([0.40 * near, 0.39 * up, 0.41 * side, 0.9 * -side])
    np.testing.assert_array_equal(_spread(turns), turns[[1, 2]])
    # One that is much longer does not make up for its direction, and one alone is all there is.
    np.testing.assert_array_equal(_spread(turns[[0, 1, 3]]), turns[[1, 0]])
    np.testing.assert_array_equal(_spread(turns[:1]), turns[:1])


@pytest.mark.parametrize("axis", [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.6, -0.8, 0.0], [0.1, 0.2, -0.97]])
def test_the_shortest_turn_to_a_half_space_is_along_its_normal(axis):
    axis = np.array(axis) / np.linalg.norm(axis)
    edge = np.radians(20.0)

    def held(turns):
        return turns @ axis >= edge

    side = np.cross(axis, [0.3, 0.5, 0.2])
    starts = np.array([1.1 * edge * axis + 0.3 * side / np.linalg.norm(side), 1.4 * edge * axis - 0.2 * side])
    found = _shortest(held, starts)
    assert held(found)
    assert np.linalg.norm(found) <= edge + np.radians(0.3)
    assert np.linalg.norm(_shortest(held, starts[:1])) <= edge + np.radians(0.5)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_shorter_turns_about_the_axes_of_the_frame(axis):
    turn = 0.3 * np.eye(3)[axis]
    tries = _shorter(turn, 0.03)
    np.testing.assert_allclose(np.linalg.norm(tries, axis=1), [0.27, *[0.285] * 6, *[0.297] * 6], atol=1e-12)
    np.testing.assert_allclose(tries[1:7].mean(axis=0), 0.285 / np.sqrt(1.01) * np.eye(3)[axis], atol=1e-12)


def test_the_weight_of_limbs_is_that_of_the_shifted_cuff():
    """A limb that would go through O if the cuff were shifted the other way is like any other."""
    rng = np.random.default_rng(81)
    mechanism = heavy_limbs(random_mechanism(rng, 3, ["SPS"] * 3), rng)
    points = np.array(mechanism.geometry.platform_points)
    none = np.zeros((1, 3))
    query = as_query(Rotation.from_matrix(np.eye(3)[None]), None, None)
    # Shifted by minus the cuff, the first limb lies on a line through O.
    cuff = (points[0] - 0.7 * mechanism.geometry.base_points[0])[None]
    found = _weight_of_limbs(mechanism, query, (none, cuff))
    closure, share = limb_loads(mechanism, query, none, cuff, np.array([False]))
    np.testing.assert_allclose(found, (closure - share).sum(axis=1))
    assert np.isfinite(found).all()
    margin, tensions, _ = least_held_forces(mechanism, np.eye(3)[None], (none, -cuff), np.ones((1, 3)))
    assert np.isnan(margin).all()
    assert np.isnan(tensions).all()
    # The base's shift counts as much.
    base = (points[0] / 0.7 - mechanism.geometry.base_points[0])[None]
    margin, _, _ = least_held_forces(mechanism, np.eye(3)[None], (base, none), np.ones((1, 3)))
    assert np.isnan(margin).all()


def functions():
    """Every function and method of the room, with its name."""
    for info in pkgutil.walk_packages(reaction.__path__, "exo_pin.reaction."):
        for owner in vars(importlib.import_module(info.name)).values():
            for function in (owner, *vars(owner).values()) if inspect.isclass(owner) else (owner,):
                if inspect.isfunction(function) and function.__module__.startswith(reaction.__name__):
                    yield function.__qualname__, function


def test_no_bar_is_shown_unless_it_is_asked_for():
    defaults = {
        name: shown.default
        for name, function in functions()
        if (shown := inspect.signature(function).parameters.get("progress")) and shown.default is not shown.empty
    }
    assert {"solve", "reaction_map", "movement_reaction", "remedy", "answer"} <= set(defaults)
    assert set(defaults.values()) == {False}
