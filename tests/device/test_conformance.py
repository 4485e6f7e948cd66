"""Every kind of device gives one answer at every door, and keeps it under all that changes nothing."""

import pickle

import numpy as np
import pytest
from device_doors import (
    KINDS,
    MIRROR,
    answers,
    assert_same,
    device_of,
    load,
    one_by_one,
    rounding,
    told,
)
from idle_devices import VirtualWork
from motor_kind import MotorKind
from opaque_devices import Opaque

import exo_pin as ep
from exo_pin.device import ConstantForce, Device, Route, Spring

pytestmark = pytest.mark.filterwarnings("ignore::exo_pin.NoisyMovement", "ignore::exo_pin.OutsideHumanRange")

SHIPPED = ("serial-y-x-z", "nesm", "spherical-3rrr", "3rps-passive-ball", "six-cables", "spring-support")
WRISTS = ("four-cables", "prototype", "four-linear-actuators-worn")
GENERATED = ("idle-0", "limbs-1", "handed-1")
DEVICES = (*SHIPPED, *WRISTS, *GENERATED, *KINDS)
#: One of each sort, for what changes nothing.
FEW = ("serial-y-x-z", "3rps-passive-ball", "spring-support", "four-cables", "limbs-1", "handed-1", "motor-1")


def every(*quick, slow=(), rest=()):
    """Cases: some always, slow ones with the full tests, the rest with the long ones."""
    later = [name for name in rest if name not in (*quick, *slow)]
    marked = [(name, mark) for names, mark in ((slow, "full"), (later, "long")) for name in names]
    return pytest.mark.parametrize(
        "name", [*quick, *(pytest.param(name, marks=getattr(pytest.mark, mark)) for name, mark in marked)]
    )


MORE = (
    *ep.presets(),
    *(f"idle-{seed}" for seed in range(80)),
    *(f"limbs-{seed}" for seed in range(60)),
    *(f"handed-{seed}" for seed in range(60)),
)


@every(*DEVICES, rest=MORE)
def test_every_door_gives_one_answer(name):
    exo, angles = device_of(name)
    query = {"load": load(exo.side)}
    answer = exo.reaction(exo.pose(*angles), **query)
    size = rounding(answer)
    found = answers(exo, angles)
    for door in ("map", "follow"):
        np.testing.assert_array_equal(found[f"{door} can_hold"], answer.can_hold)
        np.testing.assert_array_equal(found[f"{door} status"], answer.status)
        np.testing.assert_allclose(found[f"{door} F"], answer.shoulder_force, atol=size)
        np.testing.assert_allclose(found[f"{door} f"], answer.actuator_forces, atol=size)
    assert found["compare held"] == answer.held.mean()
    if answer.held.any():
        assert found["compare peak"] == pytest.approx(answer.peak, rel=1e-8)
    np.testing.assert_array_equal(found["minimal can_hold"], answer.can_hold)
    singles, halves = one_by_one(exo, angles, **query)
    for k, single in enumerate(singles):
        assert (single.status, single.can_hold) == (answer.status[k], answer.can_hold[k])
        np.testing.assert_allclose(single.shoulder_force, answer.shoulder_force[k], atol=size)
        assert ("can hold this pose" in single.verdict) == bool(single.held)
    np.testing.assert_allclose(
        np.concatenate([half.shoulder_force for half in halves]), answer.shoulder_force, atol=size
    )
    np.testing.assert_array_equal(np.concatenate([half.status for half in halves]), answer.status)
    # The workspace takes the efforts of least shoulder force.
    if "workspace inside" in found:
        np.testing.assert_array_equal(found["workspace inside"], found["minimal can_hold"])
        held = found["workspace inside"]
        least = np.linalg.norm(found["minimal F"], axis=-1)
        np.testing.assert_allclose(found["workspace magnitude"][held], least[held], rtol=1e-6, atol=100.0 * size)
    assert np.isfinite(answer.shoulder_force[answer.has_answer]).all()


@every(*FEW, slow=[name for name in DEVICES if name not in FEW], rest=MORE)
def test_the_mirror_image(name):
    exo, angles = device_of(name)
    one, two = answers(exo, angles), answers(exo.mirrored(), angles)
    for key in two:
        if key.endswith(" F"):
            two[key] = two[key] * MIRROR
        elif key.endswith(" J"):
            two[key] = -two[key] * MIRROR
        elif key.endswith(" f") and two[key].shape[-1] > exo.chain_device.driven_moments and not exo.device.holds_alone:
            # Moments of the wearer are no pseudovectors' mirror images by their numbers.
            two[key] = np.concatenate([two[key][..., :-3], -two[key][..., -3:] * MIRROR], axis=-1)
    assert_same(one, two)


@every(*FEW, slow=[name for name in DEVICES if name not in FEW], rest=MORE)
def test_the_order_of_drives(name):
    exo, angles = device_of(name)
    exo = ep.ShoulderExo.from_device(exo.chain_device)
    count = len(exo.device.drives)
    order = np.random.default_rng(count).permutation(count)
    other = exo.replace(drives=[exo.device.drives[k] for k in order])
    one, two = answers(exo, angles), answers(other, angles)
    back = np.argsort(order)
    for key in two:
        if key.endswith(" f"):
            two[key] = np.concatenate([two[key][..., :count][..., back], two[key][..., count:]], axis=-1)
        elif key.endswith(" J"):
            two[key] = np.concatenate([two[key][..., :count, :][..., back, :], two[key][..., count:, :]], axis=-2)
    assert_same(one, two)


@every(*FEW, slow=[name for name in DEVICES if name not in FEW], rest=MORE)
def test_a_passive_part_changes_nothing(name):
    exo, angles = device_of(name)
    exo = ep.ShoulderExo.from_device(exo.chain_device)
    way = Route.over(("universe", [0.0, 0.1, 0.35]), (exo.chain.roles.arm, [0.02, 0.0, -0.2]))
    spring = Spring("nothing", ConstantForce(0.0), route=way)
    other = exo.replace(springs=[*exo.device.springs, spring])
    one = answers(exo, angles)
    assert_same(one, answers(other, angles))
    assert_same(one, answers(other.replace(springs=exo.device.springs), angles))
    assert other.device.holds_alone == exo.device.holds_alone
    q = exo.configurations(exo.pose(*angles[:, 1]))
    if np.isfinite(q).all():
        assert exo.chain.mobility(q).degrees_of_freedom == other.chain.mobility(q).degrees_of_freedom


@every(*WRISTS, rest=ep.presets())
def test_closed_forms_answer_as_the_chain(name):
    exo, angles = device_of(name)
    one = answers(exo, angles)
    for other in (Opaque(exo.device, fast=False), exo.device.as_chain()):
        assert_same(one, answers(ep.ShoulderExo.from_device(other), angles))


#: An opaque device is asked for pictures and files, too, which takes seconds.
SLOW = (*SHIPPED[1:], *WRISTS, "idle-0", "motor-1")


@every(*(name for name in (*SHIPPED, *WRISTS, *KINDS) if name not in SLOW), slow=SLOW, rest=MORE)
def test_an_opaque_device_is_asked_no_other_name(name, tmp_path):
    exo, angles = device_of(name)
    hidden = Opaque(exo.device)
    exo, other = ep.ShoulderExo.from_device(exo.device), ep.ShoulderExo.from_device(hidden)
    assert_same(answers(exo, angles), answers(other, angles))
    one, two = told(exo, angles), told(other, angles)
    for door in one:
        assert two[door] == one[door], door
    exo.save(tmp_path / "one.toml")
    other.save(tmp_path / "two.toml")
    exo.export(tmp_path / "one.urdf")
    other.export(tmp_path / "two.urdf")
    assert not hidden.beyond
    assert isinstance(hidden, Device)
    assert_same(answers(exo, angles), answers(ep.load(tmp_path / "two.toml"), angles))


@every("serial-y-x-z", "nesm", "idle-0", "idle-1", "idle-2", "idle-3", rest=[f"idle-{k}" for k in range(200)])
def test_verdicts_by_a_linear_program_over_all_freedoms(name):
    """Efforts within the limits that meet every row of virtual work exist where, and only where, a pose is held."""
    exo, angles = device_of(name)
    device = exo.device
    assert not device.springs
    assert all(part.joint for part in device.efforts)
    poses = exo.pose(*angles)
    answer, asked = exo.reaction(poses), 0
    for k, q in enumerate(exo.configurations(poses)):
        if not np.isfinite(q).all():
            assert not answer.held[k]
            continue
        limits = answer.source.poses.limits
        n = len(device.efforts)
        lower, upper = (
            np.broadcast_to(bound, answer.actuator_forces.shape)[k, :n] for bound in (limits.lower, limits.upper)
        )
        miss = VirtualWork(device, q).worst_within(lower, upper)
        if 1e-8 < miss < 1e-6:
            continue  # neither by rounding
        assert answer.held[k] == (miss <= 1e-8), (k, miss, answer.status[k])
        asked += 1
    assert asked or not np.isfinite(exo.configurations(poses)).any()


def test_a_changed_kind_is_of_its_class():
    """Worn, mirrored, replaced and stiffened: also twice, with the numbers of the changed chain, and pickled."""
    kind = MotorKind(3)
    exo = ep.ShoulderExo.from_device(kind)
    worn = exo.worn_by(ep.Wearer(1.6, 55.0, "female"))
    changed = [worn, worn.mirrored(), worn.mirrored().mirrored(), exo.replace(springs=())]
    plain = ep.ShoulderExo.from_device(kind.as_chain()).worn_by(ep.Wearer(1.6, 55.0, "female"))
    for other in changed:
        assert isinstance(other.device, MotorKind)
        assert other.device.motors == 3
        assert other.device.as_chain() is other.device.as_chain()
    assert kind.as_chain().springs
    assert not changed[-1].device.springs
    answer = plain.reaction(plain.pose(40, 20))
    force = answer.shoulder_force
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(answer)).shoulder_force, force)
    for other, sign in zip(changed[:3], (1.0, MIRROR, 1.0), strict=True):
        found = other.reaction(other.pose(40, 20)).shoulder_force
        np.testing.assert_allclose(found, sign * force, atol=1e-9)
    assert isinstance(pickle.loads(pickle.dumps(kind.mirrored())), MotorKind)
    assert kind.stiffened("guides", 2.0) is None
