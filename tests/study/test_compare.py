"""Comparisons of designs: what is ranked, and over which poses."""

import json

import numpy as np
import pytest
from places import URDF

import exo_pin as ep
from exo_pin import InvalidInput
from exo_pin.cli import main
from exo_pin.study import adl_box

PERSON = ep.Arm.from_anthropometry(1.75, 75, "male")


@pytest.fixture(scope="module")
def prototype():
    return ep.load("prototype")


def test_ranking_is_by_held_poses():
    cables, linear = ep.load("four-cables"), ep.load("four-linear-actuators")
    table = cables.compare(linear, cables.pose([0, 30, 60, 90], 30))
    assert table["can_hold"].tolist() == [1.0, 1.0]
    assert table.ranking == (1, 0)  # equal shares: 42.1 N before 67.2 N
    first = "four-linear-actuators ranks first: it holds 100.0% of the poses, peak |F_s| 42.1 N."
    assert table.verdict.startswith(first)
    far = cables.compare(linear, adl_box(30.0))
    assert far.ranking[0] == int(far["can_hold"].argmax())
    both = cables.reaction(adl_box(30.0)).can_hold & linear.reaction(adl_box(30.0)).can_hold
    assert far["common_peak_F_s_N"][1] == pytest.approx(linear.reaction(adl_box(30.0)).magnitude[both].max())
    # What nobody knows to hold ranks behind what is known to.
    unknown = ep.load("appendix-d").compare(cables, adl_box(50.0))
    assert unknown.ranking[0] == 1
    assert "limits are not known" in " ".join(unknown.cautions)
    assert json.loads(unknown.to_json())["ranking"] == [1, 0]


def test_several_designs_of_any_kind_share_one_table(capsys):
    names = ["four-cables", str(URDF / "serial-y-x-z.urdf"), str(URDF / "spherical-3rrr.urdf")]
    man = ep.Wearer(1.755, 85, "male")
    first, *others = (ep.load(name).worn_by(man) for name in names)
    poses = adl_box(50.0)
    table = first.compare(*others, poses=poses)
    assert list(table["design"]) == ["four-cables", "serial-y-x-z", "spherical-3rrr"]
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


def test_queries_with_limits_and_compare(prototype):
    exo, poses = prototype.worn_by(PERSON), adl_box(30.0)
    other = exo.replace(limbs=(ep.Limb("SPS"),) * 3, name="cables")
    table = exo.compare(other, poses, limits="pull")
    assert list(table["design"]) == ["prototype", "cables"]
    # The prototype's muscles have strokes besides; the cables have no actuator, so that "pull" is all that is known.
    assert table["holdable"][0] == 0.0
    tensions = other.reaction(poses, limits="none").actuator_forces
    assert table["holdable"][1] == (tensions >= 0.0).all(axis=-1).mean()
    free = exo.compare(other, poses, split="minimal", limits="none")
    assert free["peak_F_s_N"][0] < 1e-5 < free["median_F_s_N"][1]
    assert 0 <= table["reach"][0] < 0.1
    assert np.isnan(table["reach"][1])  # strokes of the cables are not known


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


@pytest.mark.full
def test_the_force_in_the_joint_leads_over_a_sample():
    man = ep.Person(1.75, 75, "male")
    designs = [ep.load("four-cables"), ep.load("four-linear-actuators")]
    poses = designs[0].pose(np.linspace(0.0, 90.0, 130), 20.0)
    table = designs[0].compare(designs[1], poses=poses, person=ep.Wearer(1.75, 75, "male"), joint=True)
    assert list(table)[2:6] == ["contact_N", "peak_contact_N", "contact_without_N", "relief"]
    assert "over the held of 100 of 130 poses" in " ".join(table.heading)
    some = poses[np.unique(np.linspace(0, 129, 100).round().astype(int))]
    for k, exo in enumerate(designs):
        worn = exo.worn_by(man)
        answer = worn.reaction(some)
        assert answer.held.all()
        found = worn.joint_contact(some, man, answer)
        assert table["contact_N"][k] == pytest.approx(np.median(found.magnitude), rel=1e-6)
        assert table["relief"][k] == pytest.approx(np.median(found.relief_percent) / 100.0, rel=1e-6)
    plain = designs[0].compare(designs[1], poses=poses, person=ep.Wearer(1.75, 75, "male"))
    assert "contact_N" not in list(plain)
    assert plain["rank"].tolist() == table["rank"].tolist()
    with pytest.raises(ep.InvalidInput, match="no motion and no load"):
        designs[0].compare(designs[1], poses=some, joint=True, load=ep.Load([0.0, 0.0, -10.0]))
    figure = table.plot()
    assert figure.axes[0].get_title() == "in the joint, with muscles"
    order = list(table.ranking)
    assert [bar.get_width() for bar in figure.axes[0].patches] == pytest.approx(table["contact_N"][order].tolist())
    # A sweep of one design has the same numbers, and its picture is of them.
    worn = designs[0].worn_by(man)
    swept = ep.sweep(worn, {"scale": [1.0, 0.9]}, poses, joint=True)
    assert list(swept)[:3] == ["scale", "contact_N", "peak_contact_N"]
    assert swept["contact_N"][0] == pytest.approx(table["contact_N"][0], rel=1e-6)
    assert "over the held of 100 of 130 poses" in " ".join(swept.heading)
    (line,) = swept.plot().axes[0].get_lines()
    np.testing.assert_allclose(sorted(line.get_ydata()), sorted(swept["contact_N"]))
    with pytest.raises(ep.InvalidInput, match="no payload among the parameters"):
        ep.sweep(worn, {"payload_kg": [1.0]}, poses, payload_at=[0.0, 0.0, -0.6], joint=True)
