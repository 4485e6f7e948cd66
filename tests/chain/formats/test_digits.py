"""The tolerance of a file is that of its digits, where it makes a difference."""

import numpy as np
import pytest
from rounded_files import FORMATS, small_feature
from rounded_mechanisms import MECHANISMS, mechanism

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
