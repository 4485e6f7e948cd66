"""By what forces were chosen, and what was not checked or not used, in words."""

import pytest

import exo_pin as ep
from exo_pin.reaction import SPLITS

FACING = ep.glenoid_orientation(35, 0, -10, retroversion=5, inclination=8, degrees=True)
FREE, LEAST = SPLITS["spherical"], SPLITS["minimal"]


def wrist(*kinds):
    """Four cables, or the first three of them, whose limbs are of these kinds, without actuators."""
    exo = ep.load("four-cables")
    points = (exo.geometry.base_points[: len(kinds)], exo.geometry.platform_points[: len(kinds)])
    return ep.ShoulderExo(ep.WristGeometry(*points), exo.arm, limbs=[ep.Limb(kind) for kind in kinds])


def criterion(exo, **question):
    return exo.reaction(exo.pose(30.0, 30.0), **question).criterion


def test_the_criterion_of_a_choice_and_of_none():
    none = f"none needed: with {FREE.assumption} equilibrium determines the forces"
    assert criterion(wrist("UPU", "UPU", "UPU")) == none
    assert criterion(wrist("SPS", "SPS", "SPS"), split="minimal").startswith("none needed: with ")
    # One limb that takes a side force is enough for a choice, and so is a fourth limb.
    for kinds in (("UPU", "SPS", "SPS"), ("UPU",) * 3, ("SPS",) * 4):
        assert criterion(wrist(*kinds), split="minimal") == LEAST.criterion
    four, within = wrist("SPS", "SPS", "SPS", "SPS"), ", within the limits of the limbs"
    assert criterion(four) == FREE.criterion
    assert criterion(four, limits=(-1e4, 1e4)) == FREE.criterion + within
    weighted = "least weighted sum of squares of F_s and of the tensions"
    assert criterion(four, split="minimal", weights=ep.Weights(tension=1.0)) == weighted
    for penalty, where in ((None, "inside"), (1.0, "near")):
        cone = ep.GlenoidCone(orientation=FACING, penalty=penalty, muscle_compression=1e3)
        words = f"{FREE.criterion}, with F_s {where} the cone of the glenoid"
        assert criterion(four, cone=cone) == words
        assert criterion(four, cone=cone, limits=(-1e4, 1e4)) == words + within
    mine = type("Mine", (type(FREE),), {"name": "mine", "criterion": ""})()
    assert criterion(four, split=mine) == "that of split 'mine'"


def test_captions_name_side_forces_where_there_are_some():
    bare, cased = ep.load("four-cables").mechanism, ep.load("prototype").mechanism
    assert LEAST.caption(bare) == "of the limb forces that hold the arm, those of least |F_s|"
    assert LEAST.caption(cased) == "lower bound of |F_s| over the side forces within their limits"


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


SOFT = ep.Interface.of(5e4, 500.0, [0.0, 0.0, -0.2])


@pytest.mark.parametrize(
    ("stiffness", "guides", "interfaces", "parts"),
    [
        (2e4, (0, 2), {"harness": SOFT, "cuff": SOFT}, "shoulder, guides of limbs 1 and 3, harness, cuff"),
        (None, (), {"harness": SOFT}, "harness"),
        (None, (), {"cuff": SOFT}, "cuff"),
        (2e4, (), {}, "shoulder"),
        (None, (1,), {}, "guides of limb 2"),
        (None, (), {}, ""),
    ],
)
def test_the_stiffness_that_rigid_splits_leave_out_is_named(stiffness, guides, interfaces, parts):
    limbs = [ep.Limb("UPU", guide=ep.LimbGuide(60.0, 50.0) if i in guides else None) for i in range(3)]
    exo = ep.load("prototype").worn_by(ep.Person(1.75, 75, "male"))
    exo = exo.replace(limbs=limbs, shoulder=ep.Shoulder(stiffness=stiffness), interfaces=ep.Interfaces(**interfaces))

    def named(split):
        texts = exo.reaction(exo.pose(30.0, 30.0), split=split, limits="none").cautions
        return [text for text in texts if text.startswith("Not used")]

    for split in ("spherical", "minimal"):
        told = f', which split={split!r} takes as rigid (split="elastic" uses it).'
        assert named(split) == ([f"Not used: the stiffness of {parts}{told}"] if parts else [])
    if stiffness is not None:
        assert named("elastic") == []
