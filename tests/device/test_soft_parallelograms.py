"""Devices that give way with a parallelogram in them, whose loop holds more than it must, in any order of bodies."""

import numpy as np
import pytest
from parallelogram_supports import ORDERS, parallelogram_support

import exo_pin as ep
from exo_pin.device import LinearSpring, Route, SoftLink, Spring

CUFF = ep.Interface.of([2e4, 3e4, 2e4], [150.0, 200.0, 100.0], (0.0, 0.01, -0.2))
HARNESS = ep.Interface.of(4e4, 900.0, (-0.1, 0.1, 0.1))
POSE = (3.0, 6.0, 4.0)
CASE = {"split": "elastic", "limits": "none", "centre_offset": [0.002, -0.001, 0.002]}


def soft(exo, links=()):
    parts = {"interfaces": ep.Interfaces(HARNESS, CUFF), "shoulder": ep.Shoulder(stiffness=3e4)}
    return exo.replace(**parts, soft_links=links)


@pytest.mark.parametrize("seed", [1, pytest.param(3, marks=pytest.mark.full)])
def test_order_of_bodies_and_kind_of_closing_change_nothing(seed):
    """The spherical closure has one row too many, the revolute one three; the arm is before, behind or below."""
    answers = []
    for order in ORDERS:
        for closing in ("spherical", "revolute"):
            exo = soft(parallelogram_support(seed, order, closing))
            answers.append(exo.reaction(exo.pose(*POSE), **CASE))
    first = answers[0]
    assert first.status == "ok"
    assert np.linalg.norm(first.interface_displacements[1, :3]) > 1e-4
    scale = float(np.linalg.norm(first.shoulder_force))
    for other in answers:
        assert other.status == "ok"
        assert other.residual < 1e-9
        for name in ("shoulder_force", "cuff_wrench", "harness_wrench", "actuator_forces"):
            np.testing.assert_allclose(getattr(other, name), getattr(first, name), atol=1e-8 * scale, err_msg=name)
        np.testing.assert_allclose(other.interface_displacements, first.interface_displacements, atol=1e-11)


@pytest.mark.parametrize("seed", [1, *(pytest.param(seed, marks=pytest.mark.full) for seed in (3, 6, 8))])
@pytest.mark.parametrize("part", ["cuff", "all"])
def test_stiffer_and_stiffer_it_is_the_rigid_device(seed, part):
    """The difference falls as 1/k, from 1e6 to 1e12 N/m; a link of the parallelogram gives way, too."""
    order = ORDERS[seed % 3]
    exo = parallelogram_support(seed, order, "revolute")
    rigid = exo.reaction(exo.pose(*POSE), limits="none")
    assert rigid.status == "ok"
    times_k = []
    for k in 10.0 ** np.arange(6, 13):
        parts = {"interfaces": ep.Interfaces(cuff=ep.Interface.of(k, 0.02 * k, (0.0, 0.0, -0.2)))}
        if part == "all":
            spring = ep.Interface.of(k, 0.02 * k)
            parts["interfaces"] = ep.Interfaces(ep.Interface.of(k, 0.05 * k), parts["interfaces"].cuff)
            parts["shoulder"] = ep.Shoulder(stiffness=k)
            parts["soft_links"] = [SoftLink("rod", spring), SoftLink("rod_2", spring), SoftLink("fork", spring)]
        answer = exo.replace(**parts).reaction(exo.pose(*POSE), split="elastic", limits="none")
        assert answer.status == "ok"
        missing = [getattr(answer, name) - getattr(rigid, name) for name in ("shoulder_force", "actuator_forces")]
        times_k.append([k * np.linalg.norm(each) for each in missing])
    times_k = np.array(times_k)
    assert (times_k[-1] > 1.0).all()
    np.testing.assert_allclose(times_k[1:], np.broadcast_to(times_k[-2], times_k[1:].shape), rtol=0.15)


def test_a_spring_in_the_parallelogram_balances_what_its_drive_would():
    """With the spring the crank's drive gives less by the moment of the spring about it, at the displaced geometry."""
    exo = soft(parallelogram_support(1))
    route = Route.over(("yoke", (0.0, 0.0, 0.12)), ("rod", (0.1, 0.02, -0.05)))
    sprung = exo.replace(springs=[Spring("strut", LinearSpring(400.0, 0.05), route=route)])
    pose = exo.pose(*POSE)
    # The spring acts between links of the device: a drive that pulls along its route can stand in its place.
    plain, with_ = exo.reaction(pose, **CASE), sprung.reaction(pose, **CASE)
    change = with_.actuator_forces - plain.actuator_forces
    names = [drive.name for drive in exo.device.drives]
    assert abs(change[names.index("crank")]) > 1.0
    np.testing.assert_allclose(np.delete(change, names.index("crank")), 0.0, atol=1e-9)
    # Spring and drive are between the same two links, which turn about one hinge: nothing else notices.
    np.testing.assert_allclose(with_.shoulder_force, plain.shoulder_force, atol=1e-8)
    np.testing.assert_allclose(with_.interface_displacements, plain.interface_displacements, atol=1e-11)
