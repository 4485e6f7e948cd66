"""Assembly branches of a crank-rocker: held joints, paths, targets and the command stay on that of a configuration."""

import json

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import five_bar

from exo_pin import InvalidInput, LoopNotClosed
from exo_pin.chain import ClosedChain, Closure, Placement
from exo_pin.cli import main
from exo_pin.core import errors

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


@pytest.mark.parametrize("side", [1, -1])
def test_a_target_is_reached_on_the_branch_of_the_configuration(side):
    """The rocker's tip at another place: of two crank angles and two sides that with the side of the start."""
    chain = crank_rocker("tips")
    start = chain.close(assembled(FIRST, side, "tips"))
    for turn in (20.0, 60.0, 90.0):
        wanted = assembled(FIRST + np.deg2rad(turn), side, "tips")
        found = chain.inverse_kinematics("crank", chain.placement(wanted, "crank"), start)
        assert _near(found, wanted), turn
    with pytest.raises(LoopNotClosed, match="crank does not reach its target"):
        chain.inverse_kinematics("crank", pin.SE3(np.eye(3), np.array([0.0, 0.0, 9.0])), start)


def test_where_the_branch_ends_another_one_is_named():
    """A five-bar whose left crank passes where the forearms do not reach: beyond that the loop closes again."""
    named = five_bar()
    chain, moved = named.chain(), named.q.copy()
    moved[0] += 1.25
    with pytest.raises(LoopNotClosed):
        chain.close(moved, hold=chain.roles.actuated)
    moved[0] += 0.75
    with pytest.warns(errors.BranchChanged, match="ends before it has left_crank_hinge"):
        found = chain.close(moved, hold=chain.roles.actuated)
    assert np.abs(chain.residual(found)).max() < 1e-12
    np.testing.assert_array_equal(found[[0, 2]], moved[[0, 2]])


def test_a_limit_on_the_branch_is_no_end_of_it():
    """The rocker of the drawn branch is beyond its limit, and that of the other branch within."""
    start, wanted = (assembled(np.deg2rad(angle), 1, "tips") for angle in (40.0, 100.0))
    free = crank_rocker("tips")
    model = free.model.copy()
    model.lowerPositionLimit[2], model.upperPositionLimit[2] = -3.0, wanted[2] - 0.05
    chain = ClosedChain(model, free.description)
    moved = chain.close(start)
    moved[0] = wanted[0]
    with pytest.warns(errors.BranchChanged, match="configuration the limits of rocker are passed: another branch"):
        found = chain.close(moved, hold=["crank"], respect_limits=True, restarts=40)
    assert _near(found, assembled(wanted[0], -1, "tips"))
    assert _near(chain.close(moved, hold=["crank"]), wanted)


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


def test_given_joints_are_exactly_where_they_were_asked_to_be():
    named = five_bar()
    chain, joints = named.chain(), ["left_crank_hinge", "right_crank_hinge"]
    index = [chain.configuration_slice(name).start for name in joints]
    rng = np.random.default_rng(5)
    for _ in range(4):
        asked = named.q[index] + rng.uniform(-0.35, 0.35, 2)
        found = chain.forward_kinematics(asked, named.q, joints)
        np.testing.assert_array_equal(found[index], asked)
        assert np.abs(chain.residual(found)).max() <= 1e-12
    with pytest.raises(InvalidInput, match="joints="):
        chain.forward_kinematics([0.0], named.q, joints=[])
