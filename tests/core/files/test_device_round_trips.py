"""Files of devices: what is written with every optional key drawn at random comes back equal."""

from dataclasses import replace
from inspect import signature

import numpy as np
import pytest
from drawn_records import COUNT, Drawn, actuator, guide, shoulder
from places import URDF
from same_records import same

import exo_pin as ep
from exo_pin.device import Brake, ConstantForce, Drive, GuidedSlide, LinearSpring, Route, Spring, TableLaw


def drive(draw, name, turns=False, way=None):
    """A drive in a hinge, along a route, or in a slide that is a limb."""
    low, high = sorted(draw.rng.normal(size=2).tolist())
    parts = {"lower": lambda: low - 2.0, "upper": lambda: high + 2.0, "least": lambda: low, "greatest": lambda: high}
    parts |= dict.fromkeys(("speed_limit", "power_limit", "play", "resolution"), draw.number)
    if turns:
        return draw.record(Drive, parts, name, joint=name)
    parts |= {
        "actuator": lambda: actuator(draw),
        "stroke": lambda: draw.record(ep.Stroke, {"end_fitting": draw.number}, draw.number(), 0.75, 1.05),
    }
    if way is not None:
        return draw.record(Drive, parts, name, route=way)
    return draw.record(Drive, parts | {"zero_length": draw.number}, name, joint=name, pulls=True)


@pytest.mark.full
def test_drives_and_soft_parts_of_devices_come_back(tmp_path):
    draw, exo = Drawn(5), ep.load(URDF / "3rps-passive-ball.urdf")
    own = ep.ClosedChain(exo.chain.model, replace(exo.chain.description, tolerance=1e-6))
    exo = ep.ShoulderExo.from_device(exo.device.replace(chain=own))
    names = [each.joint for each in exo.device.drives]
    hinges = [name for name in map(str, exo.chain.model.names) if name.endswith("hinge")]
    arm = exo.chain.roles.arm
    for _ in range(COUNT // 6):
        way = Route.over(("universe", 0.1 * draw.rng.normal(size=3)), (arm, [0.0, 0.05, -0.2]))
        driven = [drive(draw, name) for name in names]
        driven += [drive(draw, name, turns=True) for name in hinges] + [drive(draw, "cable", way=way)]
        brakes = [draw.record(Brake, {"limit": draw.number}, f"brake of {name}", name) for name in (names[0], *hinges)]
        parts = {
            "cuff_area": lambda: 0.01,
            "cuff": lambda: ep.Interface(draw.stiffness(6), 0.1 * draw.rng.normal(size=3)),
        }
        changed = exo.device.replace(
            drives=tuple(driven),
            brakes=tuple(brakes),
            guided_slides=tuple(draw.record(GuidedSlide, {"guide": lambda: guide(draw)}, name) for name in names),
            interfaces=draw.record(ep.Interfaces, parts),
            shoulder=shoulder(draw),
        )
        ep.ShoulderExo.from_device(changed).save(tmp_path / "mine.toml")
        again = ep.load(tmp_path / "mine.toml").device
        assert again.chain.description.tolerance == 1e-6
        for name in ("drives", "brakes", "guided_slides"):
            assert getattr(again, name) == getattr(changed, name), name
        for one, other in ((again.interfaces, changed.interfaces), (again.shoulder, changed.shoulder)):
            assert same(one, other)
    assert {name for kind, name in draw.given if kind in (Drive, Brake, GuidedSlide)} >= {
        name for kind in (Drive, Brake, GuidedSlide) for name in signature(kind).parameters
    } - {"name", "slide"}


@pytest.mark.full
def test_springs_on_joints_state_efforts(tmp_path):
    """Positive towards larger coordinates, as drives do; the law in Python is the derivative of its energy."""
    springs = (
        Spring("constant", ConstantForce(-2.0), joint="flexion"),
        Spring("table", TableLaw((-4.0, 0.0, 4.0), (-1.0, 0.0, 1.5)), joint="flexion"),
        Spring("linear", LinearSpring(3.0, 0.2), joint="flexion"),
    )
    exo = ep.load(URDF / "serial-y-x-z.urdf")
    robot = ep.ShoulderExo.from_device(exo.device.replace(springs=springs)).to_urdf(tmp_path)
    assert ep.load(robot).device.springs == springs
    beside = robot.with_suffix(".device.toml")
    text = beside.read_text()
    assert "effort_N_m = 2.0" in text
    loaded = ep.load(robot)
    R = loaded.pose(30, 20, 10)
    joint = loaded.chain.model.joints[loaded.chain.model.getJointId("flexion")]
    turn = float(loaded.configurations(R)[joint.idx_q])
    efforts = 2.0 - float(springs[1].law.force(turn)) - 3.0 * (turn - 0.2)
    drive = [each.name for each in exo.device.drives].index("flexion")
    own, other = (each.reaction(R, limits="none").actuator_forces[drive] for each in (loaded, exo))
    # The drive's effort and the springs' add to what the weight needs.
    np.testing.assert_allclose(own + efforts, other, atol=1e-9)
    for old, new in (("effort_N_m", "moment_N_m"), ("efforts_N_m", "moments_N_m"), ("effort_N_m", "force_N")):
        beside.write_text(text.replace(f"{old} =", f"{new} ="))
        with pytest.raises(ep.FileFormatError, match="opposite sign: positive efforts turn"):
            ep.load(robot)
