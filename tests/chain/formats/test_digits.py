"""The tolerance of a file is that of its digits, where it makes a difference."""

import numpy as np
import pytest
from rounded_files import FORMATS, small_feature
from rounded_mechanisms import MECHANISMS, mechanism
from scipy.spatial.transform import Rotation

from exo_pin import LoopNotClosed
from exo_pin.chain import ClosedChain, read_closures, write_closures


def _assert_moves_as_the_exact_one(name, seed, digits, written, folder):
    exact = mechanism(name, None, seed)
    chain = FORMATS[written](exact, digits, folder)
    assert any(text.startswith("digits: ") for text in chain.description.left_out)
    # A right angle may have a decimal less by chance, 1.5708.
    assert 0.0 < chain.description.tolerance <= 5.001 * 10.0**-digits
    found = chain.mobility(chain.close(chain.reference_configuration()), actuated=())
    assert found.degrees_of_freedom == MECHANISMS[name], (name, seed, digits, written)
    assert found.kinds == ()
    return chain


@pytest.mark.parametrize("written", ["urdf", "mjcf", pytest.param("sdf", marks=pytest.mark.full)])
@pytest.mark.parametrize("name", MECHANISMS)
def test_a_rounded_file_moves_as_the_exact_mechanism(name, written, tmp_path):
    exact = mechanism(name, None, seed=3)
    again = {"urdf": ClosedChain.from_urdf, "sdf": ClosedChain.from_sdf, "mjcf": ClosedChain.from_mjcf}[written]
    assert again(getattr(exact, f"to_{written}")(tmp_path / "exact")).description.tolerance == 0.0
    chain = _assert_moves_as_the_exact_one(name, 3, 6, written, tmp_path / "rounded")
    # A closures file keeps the tolerance.
    write_closures(chain.description, tmp_path / "again.closures.toml")
    assert read_closures(tmp_path / "again.closures.toml").tolerance == chain.description.tolerance


@pytest.mark.parametrize("seeds", [pytest.param(1, marks=pytest.mark.full), pytest.param(5, marks=pytest.mark.long)])
@pytest.mark.parametrize("written", FORMATS)
@pytest.mark.parametrize("name", MECHANISMS)
def test_many_rounded_files_move_as_the_exact_mechanisms(name, written, seeds, tmp_path):
    """4 to 10 decimals, turned at random."""
    for seed in range(seeds):
        for digits in range(4, 11):
            _assert_moves_as_the_exact_one(name, seed, digits, written, tmp_path / f"{seed}_{digits}")


@pytest.mark.parametrize("seed", [*range(3), *(pytest.param(seed, marks=pytest.mark.full) for seed in range(3, 15))])
def test_a_small_feature_that_the_digits_hold_is_kept(seed, tmp_path):
    """A loop that is nearly planar or spherical has one freedom; its singular values are small and no rounding."""
    exact = small_feature(seed, 1e-2)
    least = exact.mobility(np.zeros(6), actuated=()).singular_values[-1]
    for written in ("urdf", "mjcf"):
        for digits in (4, 5, 6, 8):
            chain = FORMATS[written](exact, digits, tmp_path / f"{written}_{digits}")
            try:
                q = chain.close(chain.reference_configuration())
            except LoopNotClosed:
                # The error of the digits over the singular value is not small: the loop is far from closed.
                assert least < 100.0 * 10.0**-digits
                continue
            found = chain.mobility(q, actuated=())
            assert found.degrees_of_freedom == 1 or found.cautions, (written, digits)
            assert found.degrees_of_freedom == 1 or least < 100.0 * 10.0**-digits


@pytest.mark.parametrize("written", FORMATS)
@pytest.mark.parametrize("digits", [5, 7, 9])
def test_a_singular_pose_of_a_file_stays_singular(digits, written, tmp_path):
    """Both branches of a flat four-bar pass its pose: two freedoms there, one beside it."""
    chain = FORMATS[written](mechanism("planar", None, seed=1, flat=True), digits, tmp_path)
    found = chain.mobility(chain.close(chain.reference_configuration()), actuated=())
    assert found.degrees_of_freedom == 2
    assert "constraint" in found.kinds


def test_a_linkage_whose_digits_fall_badly_moves(monkeypatch, tmp_path):
    """A Sarrus linkage whose rows disagree by four times the root mean square that its four decimals explain."""
    points = np.array([[0.09, 0, 0], [0.228, 0, 0.107], [0.095, 0, 0.213]])
    other = Rotation.from_rotvec([0, 0, np.arctan2(0.3913, 0.9203)])
    across = other.apply([[0.079, 0, 0.284], [0.2446, 0, 0.142], [0.089, 0, 0]])
    axes = [np.array([0.0, 1.0, 0.0])] * 3 + [other.apply([0.0, 1.0, 0.0])] * 3
    lines = np.concatenate([points, across]), axes, [-1, 0, 1, 2, 3], [(5, 4, -1)]
    monkeypatch.setattr("rounded_mechanisms._lines", lambda _: lines)
    for seed in range(6):
        _assert_moves_as_the_exact_one("sarrus", seed, 4, "sdf", tmp_path / str(seed))


@pytest.mark.parametrize("seed", [2, 6])
def test_a_flat_parallelogram_of_any_lengths_stays_singular(seed, monkeypatch, tmp_path):
    rng = np.random.default_rng(seed)
    crank, base = rng.uniform(0.08, 0.15), rng.uniform(0.2, 0.35)
    points = np.array([[0, 0, 0], [crank, 0, 0], [crank + base, 0, 0], [base, 0, 0]])
    lines = points, [np.array([0.0, 0.0, 1.0])] * 4, [-1, 0, 1], [(3, 2, -1)]
    monkeypatch.setattr("rounded_mechanisms._lines", lambda _: lines)
    chain = FORMATS["mjcf"](mechanism("planar", None, seed), 6, tmp_path)
    found = chain.mobility(chain.close(chain.reference_configuration()), actuated=())
    assert found.degrees_of_freedom == 2
    assert "constraint" in found.kinds


def test_digits_that_make_no_difference_leave_the_geometry_exact(tmp_path):
    """A mechanism of four digits with ball joints has no redundant row: its loops close exactly."""
    text = """<mujoco><compiler angle="radian"/><worldbody>
      <body name="a" pos="0.1234 0 0"><joint name="ja" axis="0 0 1"/><geom size="0.1"/>
        <body name="b" pos="0.5012 0 0"><joint name="jb" type="ball"/><geom size="0.1"/></body></body>
      <body name="c" pos="0.1234 0.3017 0.2"><joint name="jc" axis="0 1 0.2"/><geom size="0.1"/></body></worldbody>
      <equality><connect body1="b" body2="c" anchor="0.1 0.2 0.1"/></equality></mujoco>"""
    chain = ClosedChain.from_mjcf(text)
    assert chain.description.tolerance == 0.0
    assert np.abs(chain.residual(chain.close(chain.reference_configuration()))).max() < 1e-12
