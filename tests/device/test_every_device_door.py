"""One question about a device that is not a wrist, asked at every door: one force, one verdict."""

import json

import numpy as np
import pytest
from places import URDF

import exo_pin as ep
from exo_pin.cli import main
from exo_pin.study import evaluate

MAN = ep.Wearer(1.755, 85.0, "male")
SOFT = ep.Interfaces(cuff=ep.Interface.upper_arm_cuff(distance=0.19))
#: Devices, their stiffness, and where their centre is.
DEVICES = {
    "serial-y-x-z": (None, None),
    "3rps-passive-ball": (None, [0.004, -0.003, 0.005]),
    "spring-support": (None, [0.01, -0.006, 0.012]),
    "nesm": (SOFT, [0.004, -0.003, 0.005]),
}


def case(exo):
    """Poses of a slow lift, with a load in the hand."""
    poses = exo.pose(
        np.array([5.0, 40.0, 55.0, 70.0]), np.array([50.0, 30.0, 20.0, 10.0]), np.array([0.0, 10.0, 5.0, 20.0])
    )
    return poses, ep.Load((2.0, -1.0, -5.0), (0.1, 0.0, -0.1), (0.0, 0.0, -0.2))


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.full) if name == "3rps-passive-ball" else name for name in DEVICES]
)
@pytest.mark.filterwarnings("ignore::exo_pin.NoisyMovement")
def test_every_door_gives_one_force_and_one_verdict(name):
    exo = ep.load(URDF / f"{name}.urdf").worn_by(MAN)
    soft, offset = DEVICES[name]
    split = "spherical"
    if soft is not None:
        exo, split = exo.replace(interfaces=soft), "elastic"
    poses, load = case(exo)
    question = {"load": load, "centre_offset": offset, "split": split}
    answer = exo.reaction(poses, **question)
    assert answer.has_answer.all()
    size = np.abs(answer.limb_wrenches).max() + 1.0

    def same(found, rows=slice(None)):
        np.testing.assert_array_equal(np.atleast_1d(found.can_hold), np.atleast_1d(answer.can_hold[rows]))
        np.testing.assert_allclose(found.shoulder_force, answer.shoulder_force[rows], atol=1e-8 * size)

    single = exo.reaction(poses[1], **question)
    same(single, 1)
    case_ = ep.Case(poses, load=load, centre_offset=offset)
    same(ep.solve(exo, case_, ep.Assumptions(split)))
    same(ep.solve(exo.device, case_, ep.Assumptions(split)))
    same(exo.reaction_map(poses, **question))
    movement = ep.Movement.from_samples(np.arange(len(poses)), poses, smoothing=None)
    same(exo.follow(movement, static=True, **question).reaction)
    table = exo.compare(exo, poses, **question)
    rows = [{key: table[key][-1] for key in table}, evaluate(exo, poses, **question)]
    for row in rows:
        assert row["holdable"] == answer.held.mean()
        if answer.held.any():
            assert row["peak_F_s_N"] == pytest.approx(answer.peak, rel=1e-8)
    sure = exo.uncertainty(poses[1], **question, uncertainties=_known(exo, poses[1], question))
    same(sure.answer, 1)
    if answer.held[1]:
        assert exo.remedy(poses[1], **question).nearest.distance == 0.0
    same(exo.view().show(poses[1], **question), 1)


def _known(exo, pose, question):
    """Every quantity of the question as certain."""
    centred = exo.uncertainty(pose, **question, uncertainties={"offset_mm": 0.0})
    return {"offset_mm": 0.0} | {effect.name: 0.0 for effect in centred.effects}


@pytest.mark.parametrize("name", ["serial-y-x-z", "spring-support"])
def test_the_command_line_has_the_same_answer(name, capsys):
    path = str(URDF / f"{name}.urdf")
    exo = ep.load(path).worn_by(MAN)
    answer = exo.reaction(exo.pose(40, 30, 10))
    assert main(["reaction", path, "--person", "1.755,85,male", "--flexion", "40", "--abduction", "30",
                 "--internal-rotation", "10", "--json"]) == 0  # fmt: skip
    found = json.loads(capsys.readouterr().out)
    np.testing.assert_allclose(found["spherical"]["shoulder_force"], answer.shoulder_force, atol=1e-6)


def test_workspace_holds_the_same_poses():
    exo = ep.load(URDF / "3rps-passive-ball.urdf").worn_by(MAN)
    poses, load = case(exo)
    found = exo.workspace(poses, ["forces", "stroke"], load)
    answer = exo.reaction(poses, load=load, split="minimal", constraint_bounds=0.0)
    np.testing.assert_array_equal(found.inside, answer.can_hold)
    held = answer.held
    np.testing.assert_allclose(found.magnitude[held], answer.magnitude[held], rtol=1e-6, atol=1e-6)
