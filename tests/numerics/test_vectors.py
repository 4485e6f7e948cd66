"""The vectors' kernels against NumPy and SciPy, compiled and plain."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from exo_pin.core import compiled
from exo_pin.numerics import vectors


@pytest.fixture(params=["plain", "compiled"])
def drawn(request):
    """Three vectors, a rotation, and a rectangular array, as tuples that kernels take."""
    rng = np.random.default_rng(7)
    with compiled.mode(request.param):
        yield rng.normal(size=(3, 3)), Rotation.random(rng=rng)


def rows(array):
    return tuple(map(tuple, np.asarray(array).tolist()))


def close(got, expected):
    np.testing.assert_allclose(np.array(got), expected, rtol=1e-13, atol=1e-13)


def test_products_and_sums(drawn):
    (u, v, w), turn = drawn
    a, b, c = map(tuple, (u.tolist(), v.tolist(), w.tolist()))
    close(vectors.add(a, b), u + v)
    close(vectors.dot(a, b), u @ v)
    close(vectors.cross(a, b), np.cross(u, v))
    close(vectors.triple(a, b, c), np.linalg.det([u, v, w]))
    assert vectors.root(2.25) == 1.5
    R = turn.as_matrix()
    close(vectors.turn(rows(R), a), turn.apply(u))
    close(vectors.turn_back(rows(R), a), turn.inv().apply(u))
    close(vectors.rotation_matrix(*turn.as_quat().tolist()), R)


def test_second_invariant_is_that_of_the_eigenvalues(drawn):
    array, _ = drawn
    symmetric = array @ array.T
    low, middle, high = np.linalg.eigvalsh(symmetric)
    close(
        vectors.second_invariant(tuple(symmetric[np.triu_indices(3)].tolist())), low * (middle + high) + middle * high
    )


def test_gram_is_the_weighted_outer_product(drawn):
    (u, _, _), _ = drawn
    close(vectors.gram(tuple(u.tolist()), 0.3), (0.09 * np.outer(u, u))[np.triu_indices(3)])


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_folded_means_a_small_angle_at_the_centre_whatever_the_size(drawn, size):
    identity, sine = rows(np.eye(3)), vectors.FOLDED_SINE
    for share, expected in ((0.9, True), (1.1, False)):
        at = (2.0 * size * share * sine, 0.0, -2.0 * size)
        _, _, X, _, reach, folded = vectors.limb(identity, (0.0, 0.0, 0.5 * size), at)
        assert bool(folded) is expected
        assert ((0.0, 0.0, 0.0) if expected else pytest.approx((0.0, -1.0, 0.0), abs=1e-6)) == X
        assert (reach == 0.0) is expected


def test_inertia_is_that_of_point_masses_that_move_with_the_arm(drawn):
    """Each point of mass m at r has the acceleration η × r + ω × (ω × r), and takes -m times that as a force."""
    (w, e, _), turn = drawn
    rng = np.random.default_rng(8)
    masses, points = rng.uniform(0.1, 1.0, 6), rng.normal(size=(6, 3))
    inertia = sum(m * (r @ r * np.eye(3) - np.outer(r, r)) for m, r in zip(masses, points, strict=True))
    r = turn.apply(points)
    forces = -masses[:, None] * (np.cross(e, r) + np.cross(w, np.cross(w, r)))
    mass, centre = masses.sum(), masses @ r / masses.sum()
    place = rows(turn.as_matrix()), mass, tuple(centre.tolist()), rows(inertia)
    force, moment = vectors.inertia_load(*place, tuple(w.tolist()), tuple(e.tolist()))
    np.testing.assert_allclose(force, forces.sum(axis=0), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(moment, np.cross(r, forces).sum(axis=0), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("in_arm", [False, True])
def test_a_load_acts_at_its_point(drawn, in_arm):
    (force, couple, at), turn = drawn
    arguments = rows(turn.as_matrix()), tuple(force.tolist()), tuple(couple.tolist()), tuple(at.tolist()), in_arm
    F, C = (turn.apply(force), turn.apply(couple)) if in_arm else (force, couple)
    found, moment = vectors.applied_load(*arguments)
    close(found, F)
    close(moment, C + np.cross(turn.apply(at), F))


@pytest.mark.parametrize("size", [1e-3, 0.2, 30.0])
def test_limbs_of_any_length(drawn, size):
    (a, p, _), turn = drawn
    a, p = size * a, size * p
    b = turn.apply(p)
    found = vectors.limb(rows(turn.as_matrix()), tuple(a.tolist()), tuple(p.tolist()))
    s, X = (b - a) / np.linalg.norm(b - a), -np.cross(a, b) / np.linalg.norm(np.cross(a, b))
    for got, expected in zip(found[:3], (b, s, X), strict=True):
        np.testing.assert_allclose(got, expected, rtol=1e-12, atol=1e-13 * size)
    assert found[3] == pytest.approx(np.linalg.norm(b - a), rel=1e-13)
    assert found[4] == pytest.approx(np.linalg.norm(np.cross(b, s)), rel=1e-12)
    assert not found[5]
    # On one line through O, and with both joints in one place.
    same = tuple((0.7 * turn.inv().apply(a)).tolist())
    _, _, X, length, reach, folded = vectors.limb(rows(turn.as_matrix()), tuple(a.tolist()), same)
    assert (X, reach, bool(folded)) == ((0.0, 0.0, 0.0), 0.0, True)
    assert length == pytest.approx(0.3 * np.linalg.norm(a), rel=1e-12)
