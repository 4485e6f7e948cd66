"""One question, asked at every door: one force, one verdict.

A door is a method of ShoulderExo whose result has a shoulder force, a verdict or a share of poses held. It is found by
the type of its result, so that a door that is added later has to be added here, or excepted with a reason.
"""

import dataclasses
import importlib
import inspect
import re
import typing
from functools import partial

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from wrists import random_mechanism

import exo_pin as ep
from exo_pin.study import evaluate

#: What a result has that answers the question whether and with which force a pose is held.
ANSWERS = {"shoulder_force", "can_hold", "held", "reaction", "inside", "rows", "answer"}


#: Quantities of every question that may be uncertain.
CERTAIN = ("offset_mm", "pose_deg", "A_mm", "B_mm", "mass_percent", "centre_of_mass_mm", "load_percent")


#: Methods that answer another question, with the reason.
EXCEPTIONS = {
    "track": "a simulation has the tensions that its controller and its muscles make",
    "joint_contact_of_run": "joint contact with the tensions of a simulation",
    "contact_range": "joint_contact under other assumptions",
}


def doors():
    """Methods of ShoulderExo by name whose result has one of :data:`ANSWERS`."""
    found = set()
    for name, method in inspect.getmembers(ep.ShoulderExo, inspect.isfunction):
        if name.startswith("_"):
            continue
        kind = result_type(method)
        if kind not in (None, ep.ShoulderExo, ep.ClosedChain) and ANSWERS & names_of(kind):
            found.add(name)
    return found


def result_type(method):
    """The class that a method returns, as far as its annotation names one."""
    words = re.findall(r"[A-Z]\w+", str(inspect.signature(method).return_annotation))
    for module in ("exo_pin", "exo_pin.reaction", "exo_pin.person", "exo_pin.study", "exo_pin.workspace",
                   "exo_pin.control", "exo_pin.reaction.holding.remedy",
                   "exo_pin.uncertainty.force_uncertainty"):  # fmt: skip
        for word in words:
            kind = getattr(importlib.import_module(module), word, None)
            if inspect.isclass(kind):
                return kind
    return None


def names_of(kind):
    own = {name for name, _ in inspect.getmembers(kind)}
    fields = {field.name for field in dataclasses.fields(kind)} if dataclasses.is_dataclass(kind) else set()
    return own | fields | set(typing.get_type_hints(kind)) if not dataclasses.is_dataclass(kind) else own | fields


def random_device(seed, limbs, kind):
    """A device of random joints with known strokes and actuators, tight enough that some poses are not held."""
    rng = np.random.default_rng(seed)
    mechanism = random_mechanism(rng, limbs)
    actuator = (
        ep.Actuator("cable", pull_limit=400.0)
        if kind == "cable"
        else ep.Actuator("linear", pull_limit=250.0, push_limit=120.0)
    )
    own = ep.Limb("SPS", actuator=actuator, stroke=ep.Stroke(0.3, 0.05, 10.0, 0.0))
    return ep.ShoulderExo.from_mechanism(mechanism.replace(limbs=[own] * limbs))


PRESETS = ["prototype", "four-cables", "four-linear-actuators", "three-linear-actuators", "four-muscle-cables"]


SIDES = ("left", "right")


KINDS = ("cable", "linear")


DEVICES = {f"{name}-{side}": partial(ep.load, name, side=side) for name in PRESETS for side in SIDES}


DEVICES |= {f"random-{n}-{kind}": partial(random_device, 10 * n, n, kind) for n in (3, 4, 5, 6, 7, 8) for kind in KINDS}


def case(exo):
    """A slow lift and scattered poses, with a load; the movement is quasi-static."""
    rng = np.random.default_rng(7)
    lift = exo.pose(np.linspace(5, 100, 7), np.linspace(60, 10, 7), np.linspace(0, 30, 7))
    box = exo.pose(rng.uniform(0, 110, 9), rng.uniform(0, 90, 9), rng.uniform(-20, 60, 9))
    poses = Rotation.concatenate([lift, box])
    return poses, ep.Load(rng.normal(size=3) * 5.0, rng.normal(size=3) * 0.3, [0.0, 0.0, -0.2])


@pytest.mark.parametrize("name", DEVICES)
@pytest.mark.filterwarnings("ignore::exo_pin.NoisyMovement")  # scattered poses are no measured movement
def test_every_door_gives_one_force_and_one_verdict(name):
    exo = DEVICES[name]()
    poses, load = case(exo)
    question = {"load": load, "centre_offset": None if name.endswith(("left", "cable")) else [0.01, -0.006, 0.012]}
    answer = exo.reaction(poses, **question)
    good = answer.has_answer
    size = np.abs(answer.limb_wrenches[..., :3]).max(axis=(-1, -2)) + 1.0

    def same(force, rows=good):
        assert np.isfinite(force[rows]).all()
        assert (np.linalg.norm(force - answer.shoulder_force, axis=-1)[rows] <= 1e-8 * size[rows]).all()

    # One pose at a time.
    for k in range(0, len(poses), 3):
        single = exo.reaction(poses[k], **question)
        assert single.status == answer.status[k]
        assert single.can_hold == answer.can_hold[k]
        assert ("can hold this pose." in single.verdict) == (answer.can_hold[k])
        if good[k]:
            assert np.linalg.norm(single.shoulder_force - answer.shoulder_force[k]) <= 1e-8 * size[k]
    # A map.
    chart = exo.reaction_map(poses, **question)
    np.testing.assert_array_equal(chart.status, answer.status)
    np.testing.assert_array_equal(chart.can_hold, answer.can_hold)
    same(chart.shoulder_force)
    # A movement at rest in every sample.
    movement = ep.Movement.from_samples(np.arange(len(poses)), poses, smoothing=None)
    followed = exo.follow(movement, static=True, **question)
    np.testing.assert_array_equal(followed.reaction.can_hold, answer.can_hold)
    same(followed.reaction.shoulder_force)
    assert followed.fraction_not_holdable == (~answer.held).mean()
    assert np.array_equal(followed.peak, answer.peak, equal_nan=True)
    # Design studies.
    table = exo.compare(exo, poses, **question)
    swept = ep.sweep(exo, {"lean_forward": [0.0]}, poses, **question)
    rows = [{key: columns[key][-1] for key in columns} for columns in (table, swept)]
    for row in (evaluate(exo, poses, **question), *rows):
        assert row["holdable"] == answer.held.mean()
        if answer.held.any():
            assert row["peak_F_s_N"] == pytest.approx(answer.peak, rel=1e-8)
    # How sure it is begins with the answer itself.
    if good.any():
        sure = exo.uncertainty(poses, **question, uncertainties=dict.fromkeys(CERTAIN, 0.0))
        assert sure.answer.can_hold == answer.can_hold[sure.at]
        assert abs(sure.magnitude - answer.magnitude[sure.at]) <= 1e-8 * size[sure.at]
    # What would help: nothing, where the pose is held.
    for k in np.flatnonzero(answer.held)[:1].tolist():
        assert exo.remedy(poses[k], **question).nearest.distance == 0.0
    # No limb is asked for what it cannot give where the answer says that it is held.
    low, high = answer.source.poses.limits.lower, answer.source.poses.limits.upper
    slack = 1e-9 * size[:, None]
    f = answer.actuator_forces
    assert ((f >= low - slack) & (f <= high + slack))[answer.held].all()


@pytest.mark.parametrize("name", ["four-cables-left", "four-linear-actuators-right", "three-linear-actuators-left"])
def test_workspace_holds_the_same_poses(name):
    """It takes, of the tensions within the limits, those of least shoulder force: the split "minimal"."""
    exo = DEVICES[name]()
    poses, load = case(exo)
    found = exo.workspace(poses, ["forces", "stroke"], load)
    answer = exo.reaction(poses, load=load, split="minimal", constraint_bounds=0.0)
    np.testing.assert_array_equal(found.inside, answer.can_hold)
    np.testing.assert_array_equal(answer.can_hold, exo.reaction(poses, load=load).can_hold)
    held = answer.held
    np.testing.assert_allclose(found.magnitude[held], answer.magnitude[held], rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("name", ["four-cables-left", "prototype-left", "random-5-linear"])
def test_contact_and_pictures_take_the_same_forces(name):
    pytest.importorskip("myo_sim")
    exo = DEVICES[name]()
    person = ep.Person(1.75, 75, "male")
    worn = exo.worn_by(person)
    pose = worn.pose(50, 20)
    answer = worn.reaction(pose)
    with_device = worn.joint_contact(pose, person, answer)
    np.testing.assert_array_equal(with_device.device_forces, answer.closest.actuator_forces)
    assert with_device.held == answer.held
    assert np.isnan(with_device.relief_percent) == (not answer.held)
    # The whole of the arm's moments is the same question.
    again = worn.joint_contact(pose, person)
    np.testing.assert_allclose(again.device_forces, with_device.device_forces, atol=1e-6)
    scene = ep.view.Scene(worn, human=False)
    drawn = scene.show(pose)
    np.testing.assert_array_equal(drawn.shoulder_force, answer.shoulder_force)
    assert drawn.verdict == answer.verdict


def test_every_door_is_asked_or_excepted():
    asked = {"reaction", "reaction_map", "follow", "compare", "remedy", "workspace", "joint_contact",
             "uncertainty"}  # fmt: skip
    assert doors() <= asked | set(EXCEPTIONS), doors() - asked - set(EXCEPTIONS)
    assert asked <= doors() | {"remedy", "compare"}
