"""Comparisons of designs: what is ranked, and over which poses."""

import json

import numpy as np
import pytest
from places import URDF

import exo_pin as ep
from exo_pin import InvalidInput
from exo_pin.cli import main
from exo_pin.design import DEFAULT_PRESET
from exo_pin.study import adl_box

PERSON = ep.Arm.from_anthropometry(1.75, 75, "male")


@pytest.fixture(scope="module")
def prototype():
    return ep.load("prototype")


def test_several_designs_of_any_kind_share_one_table(capsys):
    names = ["four-cables", str(URDF / "serial-y-x-z.urdf"), str(URDF / "spherical-3rrr.urdf")]
    man = ep.Wearer(1.755, 85, "male")
    first, *others = (ep.load(name).worn_by(man) for name in names)
    poses = adl_box(50.0)
    table = first.compare(*others, poses=poses)
    assert list(table["design"]) == ["four-cables", "serial-y-x-z", "spherical-3rrr"]
    with pytest.raises(ValueError, match="read-only"):
        table["can_hold"][0] = 1.0
    answers = [exo.reaction(poses) for exo in (first, *others)]
    common = np.all([answer.held for answer in answers], axis=0)
    assert 0 < common.sum() < common.size
    for row, answer in enumerate(answers):
        assert table["holdable"][row] == pytest.approx(answer.held.mean())
        assert table["common_peak_F_s_N"][row] == pytest.approx(answer.magnitude[common].max())
    # Poses after the designs are the same question, and so is the command.
    np.testing.assert_array_equal(first.compare(*others, poses)["peak_F_s_N"], table["peak_F_s_N"])
    assert main(["compare", *names, "--person", "1.755,85,male", "--step", "50", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)["columns"]
    np.testing.assert_allclose(printed["common_peak_F_s_N"], table["common_peak_F_s_N"])
    for wrong in ((), (others[0],), (poses,)):
        with pytest.raises(InvalidInput):
            first.compare(*wrong)


@pytest.mark.parametrize("name", ["appendix-d", "serial-y-x-z"])
def test_a_chain_has_the_side_of_the_singular_surface(name):
    """That of its three drives; of a wrist the same as of its normals."""
    path = URDF / f"{name}.urdf"
    exo = ep.load(path if path.exists() else name).worn_by(PERSON)
    poses = adl_box(40.0)
    chain = ep.ShoulderExo.from_device(exo.device.as_chain())
    table = exo.compare(chain, poses, limits="none")
    assert table["one_side"][0] == table["one_side"][1]
    assert not any("one_side" in text for text in table["blank"])
    kinds = chain.singularity(poses)
    sides = np.linalg.det(chain.jacobian(poses)[np.isfinite(kinds.determinant)]) > 0.0
    assert table["one_side"][1] == max(sides.mean(), 1.0 - sides.mean())
    assert (table["one_side"][1] < 1.0) == (name == "appendix-d")


def test_default_design_holds_most_daily_poses_on_everyone():
    sizes = (ep.Wearer(1.525, 51, "female"), ep.Wearer(1.87, 111, "male"))
    names = ("stroke", "forces", "clearance")
    limits = ep.Criteria(names, wearers=sizes, elbow_range=np.radians([0.0, 130.0]))
    designs = [exo for exo in map(ep.load, ep.presets()) if exo.mechanism.limbs[0].stroke is not None]
    assert len(designs) == 8
    share = {exo.name: exo.workspace(20.0, limits).index for exo in designs}
    assert max(share, key=share.get) == DEFAULT_PRESET
    assert share["prototype"] < 0.01
