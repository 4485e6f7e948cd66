"""Criterion, cautions and ends of a device's way in words, from records that are written down."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.reaction import SPLITS
from exo_pin.reaction.assumptions import comparable_splits
from exo_pin.reaction.effort_sharing import EffortSharing
from exo_pin.reaction.holding import verdict as verdicts
from exo_pin.reaction.holding.cautions import _large_side_forces, _not_used, _slack, criterion
from exo_pin.reaction.holding.hold_check import HoldCheck
from exo_pin.reaction.holding.verdict import _end_of_load, _end_of_way, _weak_axis, verdict
from exo_pin.reaction.indeterminacy.component_assumptions import ComponentSource
from exo_pin.reaction.splits.elastic import Elastic
from exo_pin.reaction.splits.minimal import Minimal

FACING = ep.glenoid_orientation(35, 0, -10, retroversion=5, inclination=8, degrees=True)


def source(kinds, split, socket=None, weights=None, bound=False, sharing=None):
    """An answer of limbs of these kinds, as far as the criterion reads it."""
    mechanism = SimpleNamespace(limb_count=len(kinds), is_upu=np.array(kinds) == "UPU", drive_units=())
    limits = SimpleNamespace(bound_forces=bound)
    tensions = SimpleNamespace(self_stress=np.zeros((1, len(kinds), len(kinds) - 3)))
    poses = SimpleNamespace(
        mechanism=mechanism, weights=weights, socket=socket, limits=limits, tensions=tensions, sharing=sharing
    )
    return SimpleNamespace(poses=poses, split=split)


def test_the_criterion_of_a_choice_and_of_none():
    free, least = SPLITS["spherical"], Minimal()
    none = f"none needed: with {free.assumption} equilibrium determines the forces"
    assert criterion(source(["UPU"] * 3, free)) == none
    assert criterion(source(["SPS"] * 3, least)).startswith("none needed: with ")
    # One limb that takes a side force is enough for a choice, and so is a fourth limb.
    for kinds in (["UPU", "SPS", "SPS"], ["UPU"] * 3, ["SPS"] * 4):
        assert criterion(source(kinds, least)) == least.criterion
    assert criterion(source(["SPS"] * 4, free)) == free.criterion
    within = ", within the limits of the limbs"
    assert criterion(source(["SPS"] * 4, free, bound=True)) == free.criterion + within
    weighted = "least weighted sum of squares of F_s and of the tensions"
    assert criterion(source(["SPS"] * 4, least, weights=ep.Weights(tension=1.0))) == weighted
    for hard, where in ((True, "inside"), (False, "near")):
        socket = SimpleNamespace(is_hard=hard)
        cone = f", with F_s {where} the cone of the glenoid"
        assert criterion(source(["SPS"] * 4, free, socket=socket)) == free.criterion + cone
        assert criterion(source(["SPS"] * 4, free, socket=socket, bound=True)) == free.criterion + cone + within
    # Of a device whose wearer makes what it cannot, and of one whose drives mix N and N m.
    wearer = EffortSharing(None, (), np.array([False, True, True, True]))
    assert criterion(source(["SPS"] * 4, free, sharing=wearer)) == f"{free.criterion}, after the wearer's least moment"
    mixed = EffortSharing(np.array([1.0, 0.1, 1.0, 1.0]), (), None)
    over = f"{free.criterion}, each effort over its greatest limit"
    assert criterion(source(["SPS"] * 4, free, sharing=mixed)) == over
    named = SimpleNamespace(criterion="", name="mine", chooses_sides=False)
    assert criterion(source(["SPS"] * 4, named)) == "that of split 'mine'"


@pytest.mark.parametrize(
    ("device", "expected"),
    [
        ("prototype", ["spherical", "minimal", "standalone"]),
        ("four-cables", ["spherical", "minimal"]),
    ],
)
def test_splits_that_fit_a_device_and_need_no_stiffness(device, expected):
    assert sorted(comparable_splits(ep.load(device).mechanism)) == sorted(expected)


def test_captions_name_side_forces_where_there_are_some():
    bare, cased = ep.load("four-cables").mechanism, ep.load("prototype").mechanism
    assert Minimal().caption(bare) == "of the limb forces that hold the arm, those of least |F_s|"
    assert Minimal().caption(cased) == "lower bound of |F_s| over the side forces within their limits"


def test_what_was_not_checked_is_said_of_stacks_whose_limits_were_asked():
    exo = ep.load("four-cables")
    unknown = exo.replace(limbs=[ep.Limb("SPS", actuator=ep.Actuator("cable"))] * 4)
    one, two = exo.pose(30, 30), exo.pose([30, 40], 30)

    def unchecked(answer):
        return [text for text in answer.cautions if text.startswith("Not checked, because not known")]

    answer = unknown.reaction(two)
    assert answer.limits.missing
    assert unchecked(answer) == [f"Not checked, because not known: {', '.join(answer.limits.missing)}."]
    assert not unchecked(unknown.reaction(one))
    assert not unchecked(unknown.reaction(two, limits="none"))
    assert not unchecked(exo.reaction(two))


def tensions(*rows):
    """f and F_s of limbs without side force, as the caution of side forces reads them."""
    return SimpleNamespace(f=np.array(rows), shoulder=np.zeros((len(rows), 3)))


def answer_of(values, held, **poses):
    limb = SimpleNamespace(actuator=object())
    mechanism = SimpleNamespace(
        limb_count=2, limbs=(limb, limb), limb_words=lambda numbers: f"limbs {numbers}", is_upu=np.zeros(2, dtype=bool)
    )
    limits = SimpleNamespace(lower=np.zeros((len(values), 2)))
    poses = SimpleNamespace(mechanism=mechanism, limits=limits, **poses)
    return SimpleNamespace(values=np.array(values, dtype=float), held=np.array(held), poses=poses)


def test_poses_that_are_not_held_have_no_slack_limbs():
    exo = ep.load("four-cables")
    moments = np.array([[900.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    for rows, held in (([0, 0], [False, False]), ([0, 1], [False, True])):
        answer = exo.reaction(exo.pose([30.0, 30.0]), load=ep.Load(np.zeros(3), moments[rows]))
        assert answer.held.tolist() == held
        slack = [text for text in answer.cautions if "slack" in text]
        alone = exo.reaction(exo.pose(30.0)).cautions if held[1] else ()
        assert slack == [text for text in alone if "slack" in text]


def test_forces_below_one_newton_count_like_large_ones():
    """Shares of the largest force, however small that is."""

    def slack(values):
        own = answer_of(values, [True] * len(values))
        return len(list(_slack(own.poses.mechanism, own, own.held)))

    assert slack([[1e-10, 0.01, 0, 0, 1, 1, 1]]) == 0
    assert slack([[1e-12, 0.01, 0, 0, 1, 1, 1]]) == 1


@pytest.mark.parametrize(("f", "named"), [([0.1, 30.0], False), ([30.0, 0.1], False), ([0.1, 0.2], True)])
def test_side_forces_are_large_beside_the_largest_tension(f, named):
    own = answer_of([[1.0, 1.0, 40.0, 1.0, 0, 0, 0]], [True], tensions=tensions(f))
    assert bool(list(_large_side_forces(own, own.held))) == named


def ended(status, share=None, placed=None, matrices=None, shape=()):
    poses = SimpleNamespace(placed=placed, matrices=matrices, mechanism=SimpleNamespace(side="left"))
    full = None if share is None else np.full(shape, share)
    return SimpleNamespace(source=SimpleNamespace(poses=poses), status=np.full(shape, status), load_share=full)


def test_where_the_way_of_a_device_ends():
    assert _end_of_load(0.25, "out_of_reach") == (
        "Beyond 25 % of the offset its loops open: what is rigid of it does not follow."
    )
    assert _end_of_load(0.0, "out_of_reach") == ("With the offset its loops open: what is rigid of it does not follow.")
    assert _end_of_load(0.5, "no_equilibrium") == "At 50 % of load and offset what is soft gives way."
    assert _end_of_load(0.5, "not_solved") == ""
    # Of an elastic device the share of the load, of single poses that did not get to the end.
    assert _end_of_way(ended("no_equilibrium", 0.4)) == "At 40 % of load and offset what is soft gives way."
    assert _end_of_way(ended("no_equilibrium", 1.0)) == ""
    assert _end_of_way(ended("no_equilibrium", 0.4, shape=(2,))) == ""
    assert _end_of_way(ended("ok")) == ""
    # Of a rigid one the pose up to which it turns: a share of the way from rest.
    pose = ep.shoulder_rotation(40, 0, 0, degrees=True)
    placed = SimpleNamespace(share=np.array([0.75]))
    lost = ended("out_of_reach", placed=placed, matrices=pose.as_matrix()[None])
    assert _end_of_way(lost) == (
        "On the way from rest it gets as far as flexion 30°, abduction 0°, internal rotation 0°."
    )
    placed.share[0] = 0.0
    assert _end_of_way(lost) == (
        "Its loops do not close even at rest: off its centre a rigid device needs a cuff that gives way."
    )
    assert _end_of_way(ended("singular", placed=placed, matrices=pose.as_matrix()[None])) == ""
    assert _end_of_way(ended("out_of_reach", matrices=pose.as_matrix()[None])) == ""
    assert _end_of_way(ended("out_of_reach", placed=placed, shape=(1,))) == ""


def test_the_weak_axis_is_that_of_the_device_or_of_the_geometry():
    axis = np.array([0.0, 0.6, 0.8])
    of_device = ended("singular", placed=SimpleNamespace(weak_axis=axis[None]))
    np.testing.assert_array_equal(_weak_axis(of_device), axis)
    exo = ep.load("prototype")
    pose = Rotation.from_matrix(exo.pose(abduction=90).as_matrix())
    answer = exo.reaction(pose, limits="none")
    assert answer.equilibrium_status == "singular"
    lost = _weak_axis(answer)
    # No tension, and no side force, gives a moment about that axis.
    on_arm = pose.apply(np.array(exo.geometry.platform_points))
    lines = on_arm - exo.geometry.base_points
    arms = np.cross(on_arm, lines / np.linalg.norm(lines, axis=1)[:, None])
    assert np.linalg.norm(lost) == pytest.approx(1.0)
    np.testing.assert_allclose(arms @ lost, 0.0, atol=1e-9)


def test_a_verdict_ends_with_the_limbs_that_pass_through_the_wearer(monkeypatch):
    exo = ep.load("four-cables")
    answer = exo.reaction(exo.pose(30.0))
    asked = answer.source.poses
    monkeypatch.setattr(
        verdicts, "gaps", lambda *given: SimpleNamespace(words="TOUCHED" if given[1] is asked.matrices else "")
    )
    assert verdicts.verdict_of(answer) == "The device can hold this pose. TOUCHED"


DRIVES = (("lift", "N m"), ("wearer about z", "N m"))


def stack(drives=(), n=2, **given):
    zero, no = np.zeros((3, n)), np.zeros(3, dtype=bool)
    fields = dict.fromkeys(("length_error", "force_error", "excess_speed", "tensions"), zero)
    fields |= {"can_hold": no, "violated": np.ones(3, dtype=bool), "unknown": no, "missing": (), "estimated": ()}
    return HoldCheck(**(fields | {"drives": drives} | {key: np.array(value) for key, value in given.items()}))


def test_each_reason_of_a_stack_counts_its_own_poses():
    """What no limits would explain is named only where no force is beyond its limit."""
    force = [[0.0, 3.0], [0.0, 0.0], [0.0, 0.0]]
    assert verdict(stack(force_error=force), np.array(["infeasible"] * 3)) == (
        "The device can hold none of 3 poses: a limb would have to pull too hard (1), no forces within the limits "
        "balance it (2)."
    )
    # Without drives no drive is to blame.
    assert verdict(stack(), np.array(["ok"] * 3)) == "The device can hold none of 3 poses."
    # A moment of the wearer's own muscles is not one of a drive.
    for column, words in ((0, "a drive would have to give more than it can"),
                          (1, "the wearer's own muscles would have to add moments")):  # fmt: skip
        force = np.zeros((3, 2))
        force[1, column] = -2.0
        assert verdict(stack(DRIVES, force_error=force), np.array(["ok"] * 3)) == (
            f"The device can hold none of 3 poses: {words} (1)."
        )
    past = [[0.1, 0.0], [np.nan, np.nan], [0.0, 0.0]]
    assert verdict(stack(DRIVES, length_error=past), np.array(["ok"] * 3)).endswith(
        ": a drive would be beyond its range (1)."
    )


def test_a_source_that_is_held_has_nothing_unmet():
    chosen = SimpleNamespace(unmet=np.array([0, 7, 8]))
    own = ComponentSource(None, None, (3,), np.zeros((3, 9)), chosen)
    assert own.held.tolist() == [True, False, False]


def test_the_stiffness_that_rigid_splits_leave_out_is_named():
    def named(split, harness=None, cuff=None, stiffness=None, guides=(0,)):
        limbs = [SimpleNamespace(guide=object() if i in guides else None) for i in range(3)]
        interfaces, shoulder = SimpleNamespace(harness=harness, cuff=cuff), SimpleNamespace(stiffness=stiffness)
        mechanism = SimpleNamespace(limbs=limbs, interfaces=interfaces, shoulder=shoulder)
        return list(_not_used(mechanism, SimpleNamespace(split=split)))

    rigid, some = SPLITS["spherical"], object()
    held = SimpleNamespace(determines_sides=True, moves=False, name="held")
    told = ", which split='spherical' takes as rigid (split=\"elastic\" uses it)."
    assert named(rigid, some, some, some, (0, 2)) == [
        f"Not used: the stiffness of shoulder, guides of limbs 1 and 3, harness, cuff{told}"
    ]
    assert named(rigid, harness=some, guides=()) == [f"Not used: the stiffness of harness{told}"]
    assert named(rigid, cuff=some, guides=()) == [f"Not used: the stiffness of cuff{told}"]
    assert named(rigid, stiffness=some, guides=()) == [f"Not used: the stiffness of shoulder{told}"]
    assert named(rigid, guides=(1,)) == [f"Not used: the stiffness of guides of limb 2{told}"]
    assert named(rigid, guides=()) == []
    assert named(held, cuff=some, stiffness=some)[0].startswith("Not used: the stiffness of cuff, which split='held'")
    assert named(Elastic(), some, some, some) == []


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("force_error", -0.5, "a limb would have to push"),
        ("force_error", 0.5, "a limb would have to pull too hard"),
        ("length_error", -0.5, "a limb would be too short"),
        ("length_error", 0.5, "a limb would be too long"),
        ("excess_speed", 0.5, "a limb would have to be too fast"),
        ("length_error", np.inf, "an actuator cannot take the length of its limb"),
    ],
)
def test_poses_are_counted_and_not_limbs(field, value, words):
    """One limb in two of three poses, and both limbs in one of them."""
    for rows, count in (([[1, 0], [0, 0], [1, 0]], 2), ([[0, 0], [1, 1], [0, 0]], 1)):
        given = np.where(np.array(rows) == 1, value, 0.0)
        assert verdict(stack(**{field: given}), np.array(["ok"] * 3)) == (
            f"The device can hold none of 3 poses: {words} ({count})."
        )
    for drives in ((("lift", "N m"), ("rope", "N")), (("wearer about x", "N m"), ("wearer about z", "N m"))):
        given = np.array([[0.5, 0.0], [0.0, 0.0], [0.25, 0.0]])
        assert verdict(stack(drives, force_error=given), np.array(["ok"] * 3)).endswith(" (2).")
        assert verdict(stack(drives, length_error=given), np.array(["ok"] * 3)).endswith(" (2).")
