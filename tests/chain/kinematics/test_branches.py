"""Assembly branches of a crank-rocker: held joints, paths, targets and the command stay on that of a configuration."""

import json

import numpy as np
import pytest

from exo_pin import LoopNotClosed
from exo_pin.chain import ClosedChain, Closure, Placement
from exo_pin.cli import main

#: Ground, crank, coupler and rocker, m.
GROUND, CRANK, COUPLER, ROCKER = 1.0, 0.5, 1.2, 0.8
FIRST = np.deg2rad(40.0)


def _bar(name, at, length, inside=""):
    joint = f'<joint name="{name}" axis="0 -1 0"/><geom type="capsule" fromto="0 0 0 {length} 0 0" size="0.01"/>'
    return f'<body name="{name}" pos="{at} 0 0">{joint}{inside}</body>'


def crank_rocker(cut):
    """Open between coupler and rocker, or between rocker and ground."""
    if cut == "tips":
        bars = _bar("crank", 0.0, CRANK, _bar("coupler", CRANK, COUPLER)) + _bar("rocker", GROUND, ROCKER)
        pin = Closure("pin", "spherical", "coupler", "rocker", Placement((COUPLER, 0, 0)), Placement((ROCKER, 0, 0)))
    else:
        bars = _bar("crank", 0.0, CRANK, _bar("coupler", CRANK, COUPLER, _bar("rocker", COUPLER, ROCKER)))
        pin = Closure("pin", "spherical", "rocker", "universe", Placement((ROCKER, 0, 0)), Placement((GROUND, 0, 0)))
    return ClosedChain.from_mjcf(f"<mujoco><worldbody>{bars}</worldbody></mujoco>").with_closure(pin)


def assembled(crank, side, cut):
    """By the triangle of coupler, rocker and the line between crank tip and ground pivot."""
    tip, pivot = CRANK * np.array([np.cos(crank), np.sin(crank)]), np.array([GROUND, 0.0])
    line = pivot - tip
    reach = np.linalg.norm(line)
    corner = np.arccos((COUPLER**2 + reach**2 - ROCKER**2) / (2.0 * COUPLER * reach))
    coupler = np.arctan2(line[1], line[0]) + side * corner
    rocker = np.arctan2(*(tip + COUPLER * np.array([np.cos(coupler), np.sin(coupler)]) - pivot)[::-1])
    return np.array([crank, coupler - crank, rocker if cut == "tips" else rocker + np.pi - coupler])


def _near(found, wanted):
    return np.abs((found - wanted + np.pi) % (2.0 * np.pi) - np.pi).max() < 1e-7


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("cut", ["tips", "ground"])
def test_a_held_crank_stays_on_the_branch_of_the_configuration(cut, side):
    chain = crank_rocker(cut)
    start = chain.close(assembled(FIRST, side, cut))
    rows = np.tile(start, (17, 1))
    rows[:, 0] += np.deg2rad(21.0) * np.arange(1, 18)
    for row in rows:
        wanted = assembled(row[0], side, cut)
        assert _near(chain.close(row, hold=["crank"]), wanted), np.rad2deg(row[0])
        assert _near(chain.forward_kinematics(row[:1], start, ["crank"]), wanted)
    # A stack is closed as its samples are.
    found = chain.close(rows[::4], hold=["crank"])
    assert all(_near(one, assembled(row[0], side, cut)) for one, row in zip(found, rows[::4], strict=True))


@pytest.mark.parametrize("angle", [120, 240, 300])
def test_the_command_answers_for_the_drawn_branch(angle, tmp_path, capsys):
    """The torque of the crank that holds the bars' weight, and its angles in all closed configurations."""
    bars = _bar("crank", 0.0, CRANK, _bar("coupler", CRANK, COUPLER)) + _bar("rocker", GROUND, ROCKER)
    equality = f'<equality><connect body1="coupler" body2="rocker" anchor="{COUPLER} 0 0"/></equality>'
    path = tmp_path / "crank_rocker.xml"
    path.write_text(f"<mujoco><worldbody>{bars}</worldbody>{equality}</mujoco>", encoding="utf-8")
    chain = ClosedChain.from_mjcf(path)
    start = chain.close(chain.reference_configuration())
    wanted = chain.inverse_dynamics(
        chain.forward_kinematics([np.deg2rad(angle)], start, ["crank"]), actuated=["crank"]
    ).effort("crank")[0]
    out = tmp_path / "forces.json"
    assert main(["forces", str(path), "--set", f"crank={angle}deg", "--actuated", "crank", "--out", str(out)]) == 0
    capsys.readouterr()
    (found,) = json.loads(out.read_text(encoding="utf-8"))["efforts"]["crank"]["value"]
    assert found == pytest.approx(wanted, rel=1e-9)
    assert main(["kinematics", str(path), "--set", f"crank={angle}deg"]) == 0
    said = capsys.readouterr().out
    assert "crank held: 2 closed configurations from" in said
    assert f"{angle if angle <= 180 else angle - 360:.2f} °" in said
    assert main(["mobility", str(path), "--set", f"crank={angle}deg"]) == 0
    assert "left out             contact: " in capsys.readouterr().out


def test_a_path_says_where_its_branch_ends():
    """A rod of 1 m on a slide and a lever of 1 m are stretched where the slide is 2 m away."""
    rod = '<body><joint name="{0}" axis="0 1 0"/><geom size="0.1"/><site name="{0}" pos="0 0 1"/></body>'
    slide = '<body><joint name="slide" type="slide" axis="1 0 0"/><geom size="0.1"/>' + rod.format("rod") + "</body>"
    pin = '<equality><connect site1="rod" site2="lever"/></equality>'
    mjcf = f"<mujoco><worldbody>{slide}{rod.format('lever')}</worldbody>{pin}</mujoco>"
    chain = ClosedChain.from_mjcf(mjcf)
    near = chain.close([1.0, -0.5, 0.5], hold=["slide"])
    with pytest.raises(LoopNotClosed, match="the branch ends after 50 % of the way") as caught:
        chain.forward_kinematics([3.0], near, ["slide"])
    assert caught.value.q[0] == pytest.approx(2.0, abs=1e-3)
    assert abs(chain.residual(caught.value.q)).max() < 1e-9
