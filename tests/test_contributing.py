"""What docs/contributing.md says how to add is run as it stands there."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from command_line import run
from matplotlib import pyplot
from places import page
from scenes import panel

import exo_pin as ep
from exo_pin.chain import TYPES
from exo_pin.reaction import SPLITS, Split, reaction_table
from exo_pin.view import Scene
from exo_pin.view.plots import rotation_ball, workspace_slices
from exo_pin.workspace import CRITERIA, task_reach

BLOCKS = re.findall(r"```python\n(.*?)```", page("contributing"), re.S)


REGISTRIES = {"preloaded": SPLITS, "planar": TYPES, "reach": CRITERIA}


LIFT = np.linspace(20.0, 60.0, 5)


@pytest.fixture(autouse=True)
def _added():
    names = {}
    for block in BLOCKS:
        exec(block, names)
    yield
    for name, registry in REGISTRIES.items():
        del registry[name]


@pytest.fixture(scope="module")
def exo():
    return ep.load("prototype")


def movement(exo):
    return ep.Movement.from_samples(np.linspace(0.0, 2.0, 5), exo.pose(LIFT, 30.0), smoothing=None)


def test_an_added_splits_forces_are_those_that_it_says(exo):
    answer = exo.reaction(exo.pose(LIFT, 30.0), split="preloaded", limits="none")
    np.testing.assert_array_equal(answer.constraint_forces, 2.0)
    # The arm's weight, its limbs and the shoulder are in balance.
    weight = exo.arm.mass * np.array(exo.mechanism.gravity)
    total = answer.shoulder_force + answer.limb_wrenches[..., :3].sum(axis=-2) + weight
    np.testing.assert_allclose(total, 0.0, atol=1e-9)
    # Within limits it is the same choice: three limbs have none.
    held = exo.reaction(exo.pose(LIFT, 30.0), split="preloaded", limits=(-1e6, 1e6))
    np.testing.assert_allclose(held.actuator_forces, answer.actuator_forces, atol=1e-6)


@pytest.mark.filterwarnings("ignore::exo_pin.NoisyMovement")
def test_an_added_split_stands_in_every_output(exo, capsys, tmp_path):
    split = SPLITS["preloaded"]
    single, stack = (exo.reaction(poses, split=split) for poses in (exo.pose(30, 30), exo.pose(LIFT, 30.0)))
    cables = ep.load("four-cables").reaction(exo.pose(30, 30), split=split)
    assert json.loads(single.to_json())["split"] == "preloaded"
    assert "preloaded" in reaction_table([single, exo.reaction(exo.pose(30, 30))])
    assert split.assumption in str(single)
    assert split.criterion in cables.criterion
    free = exo.reaction(exo.pose(30, 30), split=split, limits="none")
    assert free.range().least == pytest.approx(free.magnitude)
    followed = exo.follow(movement(exo), static=True, split=split)
    assert "preloaded" in single.plot().get_supxlabel()
    for figure in (single.plot(), stack.plot(), followed.plot()):
        assert figure.axes
    pyplot.close("all")
    scene = Scene(exo, human=False)
    scene.show(exo.pose(30, 30), split=split)
    assert any("(split “preloaded”)" in note["text"] for note in panel(scene, "numbers")["notes"])
    for command in ("reaction", "sweep"):
        more = ["--vary", "lean_forward_deg=0", "--step", "60"] if command == "sweep" else ["--flexion", "30"]
        status, out, _ = run(capsys, command, "prototype", *more, "--split", "preloaded")
        assert status == 0
        assert ("on the head" if command == "reaction" else "F_s") in out


class Nameless(Split):
    assumption = "none"
    choose = program = lambda *_: None


class Misnamed(Nameless):
    name = "minimal"


class Moving(Nameless):
    name, moves = "moving", True


@pytest.mark.parametrize(
    ("split", "word"),
    [
        (Nameless(), "name to be words"),
        (Misnamed(), "a name of its own"),
        (Moving(), "child of Elastic"),
        (Nameless, "an instance, got the class Nameless"),
        (3.0, "preloaded"),
    ],
)
def test_a_split_that_is_none_is_refused(exo, split, word):
    with pytest.raises(ep.InvalidInput, match=word):
        exo.reaction(exo.pose(30, 30), split=split)


def test_an_added_criterion_in_every_table_picture_and_command(exo, capsys, tmp_path):
    item = CRITERIA["reach"]
    found = exo.workspace(30.0)
    margin = 0.35 - found.lengths.max(axis=-1)
    np.testing.assert_array_equal(found.margins["reach"], margin)
    assert found.fractions["reach"] == (margin >= 0.0).mean()
    assert "reach" in found.lost_to
    assert ("reach" in found.reasons[np.unravel_index(margin.argmin(), margin.shape)]) == (margin.min() < 0.0)
    line = next(line for line in str(found).splitlines() if line.startswith("reach"))
    assert line.endswith(" m")
    assert list(found.one_by_one()["criterion"])[-1] == "reach"
    assert exo.workspace(30.0, ["stroke"]).not_checked["reach"] == "not chosen"
    alone = exo.workspace(30.0, ["reach"])
    words = {
        text.get_text(): handle
        for legend in workspace_slices(alone).legends
        for text, handle in zip(legend.get_texts(), legend.legend_handles, strict=True)
    }
    assert {"inside", f"not met: {item.words}"} == set(words)
    rotation_ball(alone)
    pyplot.close("all")
    assert task_reach(exo.mechanism, criteria=["reach"], step=40.0)["limited_by"].tolist().count("reach") > 0
    status, out, _ = run(capsys, "workspace", "prototype", "--step", "30", "--criteria", "reach,stroke", "--json")
    assert status == 0
    assert set(json.loads(out)["fractions"]) == {"stroke", "reach"}


def test_a_criterion_that_needs_what_there_is_not_says_so(monkeypatch):
    monkeypatch.setitem(CRITERIA, "reach", replace(CRITERIA["reach"], needs=CRITERIA["forces"].needs))
    bare = ep.load("prototype").replace(arm=None)
    assert "arm mass" in bare.workspace(60.0).not_checked["reach"]
    with pytest.raises(ep.MissingData, match="the criterion 'reach'"):
        bare.workspace(60.0, ["reach"])
