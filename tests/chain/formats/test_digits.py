"""The tolerance of a file is that of its digits, where it makes a difference."""

import decimal
import re

import numpy as np
import pinocchio as pin
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


_SENSOR = '<sensor name="s" type="imu"><pose>0.123456789012345678 0.2 0.3 0 0 0</pose></sensor>'


@pytest.mark.parametrize(
    ("written", "end", "more"),
    [("urdf", "</robot>", f'<gazebo reference="link_0">{_SENSOR}</gazebo>'), ("sdf", "</link>", _SENSOR)],
    ids=["urdf", "sdf"],
)
def test_digits_of_sensors_do_not_count_nor_how_a_caller_rounds(written, end, more, tmp_path):
    chain = FORMATS[written](mechanism("planar", None, 3), 4, tmp_path)
    (path,), read = tmp_path.glob(f"*.{written}"), getattr(ClosedChain, f"from_{written}")
    text = path.read_text(encoding="utf-8").replace(end, more + end, 1)
    path.write_text(text, encoding="utf-8")
    with decimal.localcontext() as context:
        context.prec = 3
        again = read(path)
    assert again.description.tolerance == chain.description.tolerance > 0.0
    assert again.mobility(again.neutral()).rank == chain.mobility(chain.neutral()).rank
    # A number of so many decimals is zero.
    tiny = re.sub(r'(xyz="|<pose>)[^ ]+', r"\g<1>1e-99999999999999999999", text, count=1)
    path.write_text(tiny, encoding="utf-8")
    assert read(path).model.nv == chain.model.nv


@pytest.mark.parametrize("written", FORMATS)
@pytest.mark.parametrize("digits", [5, 7, 9])
def test_a_singular_pose_of_a_file_stays_singular(digits, written, tmp_path):
    """Both branches of a flat four-bar pass its pose: two freedoms there, one beside it."""
    chain = FORMATS[written](mechanism("planar", None, seed=1, flat=True), digits, tmp_path)
    found = chain.mobility(chain.close(chain.reference_configuration()), actuated=())
    assert found.degrees_of_freedom == 2
    assert "constraint" in found.kinds


#: A planar four-bar whose hinges are about x, turned by rounded right angles so that they are about z.
SDF = """<sdf version="1.7"><model name="four_bar">
  <link name="base"/><joint name="ground" type="fixed"><parent>world</parent><child>base</child></joint>
  <link name="crank"><pose>0 0 0 0 {first} 0</pose></link>
  <link name="coupler"><pose>0 0.1 0 0 {second} 0</pose></link>
  <link name="rocker"><pose>0.3 0 0 0 {first} 0</pose></link>
  <joint name="a" type="revolute"><parent>base</parent><child>crank</child><axis><xyz>1 0 0</xyz></axis></joint>
  <joint name="b" type="revolute"><parent>crank</parent><child>coupler</child><axis><xyz>1 0 0</xyz></axis></joint>
  <joint name="c" type="revolute"><parent>base</parent><child>rocker</child><axis><xyz>1 0 0</xyz></axis></joint>
  <joint name="d" type="revolute"><pose relative_to="rocker">0 0.2 0.05 0 0 0</pose><parent>coupler</parent>
    <child>rocker</child><axis><xyz>1 0 0</xyz></axis></joint>
</model></sdf>"""


def test_rounded_angles_lock_a_plane_loop_and_exact_ones_do_not():
    """Axes that are not parallel make an exact loop spatial and rigid."""
    rounded = SDF.format(first="1.5708", second="-4.7124")
    chain = ClosedChain.from_sdf(rounded, right_angle_tolerance=2e-5)
    exact = ClosedChain.from_sdf(SDF.format(first=repr(np.pi / 2), second=repr(-1.5 * np.pi)))
    q = exact.close(pin.integrate(exact.model, exact.neutral(), np.array([0.1, 0.2, -0.1])))
    assert chain.mobility(q, actuated=()).redundant == exact.mobility(q, actuated=()).redundant == 3
    np.testing.assert_array_equal(chain.forward_dynamics(q).a, exact.forward_dynamics(q).a)
    assert chain.mobility(q, actuated=()).degrees_of_freedom == 1
    # Without it the digits say how well the file knows its geometry.
    plain = ClosedChain.from_sdf(rounded)
    assert plain.description.tolerance == 5e-5
    assert "of the loops' rows 1 agree with others" in " ".join(plain.description.left_out)
    assert plain.mobility(plain.neutral(), actuated=()).degrees_of_freedom == 1
    assert plain.with_tolerance(0.0).mobility(plain.neutral(), actuated=()).degrees_of_freedom == 0
