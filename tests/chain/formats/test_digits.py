"""The tolerance of a file is that of its digits, where it makes a difference."""

import re

import numpy as np
import pytest
from rounded_mechanisms import MECHANISMS, mechanism

from exo_pin.chain import ClosedChain
from exo_pin.chain.formats.closures_file import closures_text, read_closures
from exo_pin.chain.formats.digits import _decimals, _tolerance


@pytest.mark.parametrize(
    ("word", "decimals"),
    [("1", 0), ("0.5", 1), ("0.50000", 1), ("-1.2345", 4), ("1.5e-3", 4), ("12e2", 0), ("3.25e1", 1), ("5e-7", 7)],
)
def test_decimals_as_written(word, decimals):
    assert _decimals(word) == decimals


@pytest.mark.parametrize(
    ("words", "tolerance"),
    [
        (["0.1", "0.25"], 0.0),
        (["0.1", "0.123456"], 5e-7),
        # Right angles of doubles are exact, and rounded ones are known to their own digits.
        (["1.5707963267948966", "0.123456"], 5e-7),
        (["1.5708", "0.123456"], 5e-5),
        (["0.12345678901234567", "0.1234"], 0.0),
        (["nan", "x", "0.1234"], 5e-5),
    ],
)
def test_the_tolerance_of_words(words, tolerance):
    assert _tolerance(words) == pytest.approx(tolerance)


def _written(chain, digits, folder):
    """The chain's files with every place rounded."""
    files = chain.with_tolerance(0.0).to_urdf(folder)
    urdf = files if files.suffix == ".urdf" else next(folder.glob("*.urdf"))
    numbers = lambda found: " ".join(f"{round(float(word), digits)!r}" for word in found.group(2).split())  # noqa: E731
    text = re.sub(r'((?:xyz|rpy)=")([^"]*)', lambda found: found.group(1) + numbers(found), urdf.read_text())
    urdf.write_text(text)
    return urdf


@pytest.mark.parametrize("name", [name for name in MECHANISMS if name != "delta"])
def test_a_rounded_file_moves_as_the_exact_mechanism(name, tmp_path):
    exact = mechanism(name, None, seed=3)
    assert ClosedChain.from_urdf(exact.to_urdf(tmp_path / "exact")).description.tolerance == 0.0
    chain = ClosedChain.from_urdf(_written(exact, 6, tmp_path / "rounded"))
    assert chain.description.tolerance == 5e-7
    assert any(text.startswith("digits: ") for text in chain.description.left_out)
    found = chain.mobility(chain.close(chain.neutral()), actuated=())
    assert found.degrees_of_freedom == MECHANISMS[name]
    assert found.rank == exact.mobility(exact.neutral(), actuated=()).rank
    # A closures file keeps the tolerance.
    text = closures_text(chain.description)
    (tmp_path / "again.closures.toml").write_text(text)
    assert read_closures(tmp_path / "again.closures.toml").tolerance == 5e-7


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
