"""Answers of studies: comparisons, sweeps and ranks of designs, as they are stored."""

import numpy as np
import pytest
from answers import changes, each_of
from asked_in_turn import refused
from places import URDF

import exo_pin as ep
from exo_pin.device import Route, Spring, TableLaw
from exo_pin.study import StudyTable, adl_box, compare, evaluate, non_dominated, sweep

MAN = ep.Wearer(1.755, 85, "male", elbow_flexion=0.6, payload=0.5)
WOMAN = ep.Wearer(1.60, 55, "female")


def named(*names):
    """Designs by name."""
    return [ep.load(URDF / f"{name}.urdf" if (URDF / f"{name}.urdf").exists() else name) for name in names]


def compared(*names, **options):
    return compare(*named(*names), **({"poses": adl_box(50.0), "person": MAN} | options))


def few(exo, k=3, shape=-1):
    """Poses without a symmetry, the last farther than most devices go."""
    angles = np.array([[20.0, 75.0, 40.0, 105.0], [35.0, 10.0, 70.0, 93.0], [-10.0, 25.0, 5.0, -30.0]])
    return exo.pose(*(own[-k:].reshape(shape) for own in angles))


def row(known, far, peak, common=None, name=None, **more):
    """Figures that rank a design."""
    named = {} if name is None else {"design": name}
    leading = {} if common is None else {"common_peak_F_s_N": common}
    return named | {"can_hold": known, "holdable": far, "peak_F_s_N": peak} | leading | more


def ranked():
    """Tables of rows whose order and words are told by hand."""
    close = [row(0.5, 0.5, 50.0 * factor) for factor in (1.0, 1.0 + 9e-7, 1.0 + 1.9e-6, 1.0 + 3.1e-6)]
    shares = [row(0.5 + 0.8e-9 * k + 2e-9 * (k > 1), 0.7, 10.0 * k + 5.0) for k in range(4)]
    many = [row(0.25, 0.25, 9.0, name=f"d{k}") for k in range(11)]
    return {
        "close peaks": StudyTable(close),
        "close shares": StudyTable(shares),
        "further limits": StudyTable([row(0.3, 0.3 + 2e-9 * k, 7.0 - k, name=f"n{k}") for k in range(3)]),
        "eleven equal": StudyTable([*many, row(0.125, 0.5, 3.0, name="last"), row(0.1, 0.2, 3.0, name="z")]),
        "six equal": StudyTable([*many[:6], row(0.0, 0.0, 3.0, name="none")]),
        "seven equal": StudyTable([*many[:7], row(0.2, 0.2, np.nan, np.nan, name="z")][:7]),
        "ninth": StudyTable([*many[:9], row(0.125, 0.125, 1.0, name="b")]),
        "nothing in common": StudyTable([row(0.4, 0.4, 30.0, np.nan, "b"), row(0.6, 0.6, 20.0, np.nan, "a")]),
        "passive": StudyTable([row(0.0, 0.0, 5.0, 4.0, name) for name in "ba"] + [row(0.0, 0.0, 9.0, 8.0, "c")]),
        "one passive": StudyTable([row(0.0, 0.0, 5.0), row(0.0, 0.0, 3.5)]),
        "nothing": StudyTable([row(0.0, 0.0, np.nan), row(0.0, 0.0, np.nan)]),
        "no designs": StudyTable([row(np.nan, np.nan, np.nan, error=why) for why in ("bad", "worse")]),
        "no design": StudyTable([row(np.nan, np.nan, np.nan, error="bad"), row(0.5, 0.5, 3.0, error="")]),
        "one": StudyTable([row(0.5, 0.5, 3.0, one_side=0.9, not_evaluated=0.1)]),
        "cautions": StudyTable([row(0.5, 0.6, 3.0, one_side=1.0, not_evaluated=0.0),
                                row(0.5, 0.5, 3.0, one_side=0.8, not_evaluated=0.1),
                                row(0.4, 0.6, 3.0, one_side=0.7, not_evaluated=0.0)]),
        "unranked": StudyTable([{"r_A": 0.1, "alpha_2": 1.0, "alpha_A[2]": 1.0, "x": np.nan}], ["a head", ""]),
        "empty": StudyTable([]),
    }  # fmt: skip


def written(tmp=None):
    """A table in all forms: of text, for a notebook, as JSON and as columns of a file."""
    rows = [{"design": f"d{k}", "rank": 1 + (k > 1), "r_A": 0.1 + 0.01 * k, "alpha_2": 0.5, "error": "",
             "blank": "reach (a stroke is not known)" * (k == 1), "reach": [0.25, np.nan, 1.0][k],
             **{f"figure_of_some_length_{n}": 1234.5678 * n + k for n in range(7)}} for k in range(3)]  # fmt: skip
    table = StudyTable(rows, ["Heads stand above."])
    return [
        table,
        table._repr_html_(),
        table.to_json(None),
        table.to_json(),
        table.columns(),
        table.to_dataframe().shape,
    ]


def swept(exo, parameters, **options):
    return sweep(exo, parameters, few(exo), **options)


def sweeps():
    """Of joints on points and on circles, of persons and of text; values that make no design."""
    cables, muscles = ep.load("four-cables"), ep.load("prototype")
    return [
        swept(cables, {"cuff_height_mm": "150:230:3", "pull_limit": [90.0, -3.0]}),
        swept(cables, {"A[2].radius_mm": "140,190", "payload_kg": [0.0, 1.5]}, payload_at=[0.0, 0.01, -0.5]),
        swept(cables, {"person": [MAN, WOMAN], "lean_forward_deg": [0.0, 12.0]}, limits="none"),
        swept(muscles, {"alpha": [np.radians([25.0, 60.0, 130.0]), [0.1, 0.2], "x"], "r_A_mm": [136.3]}, limits="none"),
        swept(muscles, {"limb_kind": ["SPS", "UPU"]}, limits="none"),
        swept(muscles, {"limbs": [(ep.Limb("SPS"),) * 3, 3]}, limits="none"),
        swept(cables, {"arm": [ep.Arm(3.1, [0.0, 0.01, -0.2]), ep.Arm(2.0, [0.0, 0.0, -0.3])]}),
    ]


def refusals():
    cables, muscles = ep.load("four-cables"), ep.load("prototype")
    poses = few(cables)
    rows = {"a": [1.0, 2.0, np.nan], "b": [3.0, 3.0, 9.0]}
    return refused(
        lambda: sweep(cables, {}, poses),
        lambda: sweep(cables, [("scale", [1.0])], poses),
        lambda: sweep(cables, {"stiffness_of_cuff": [1.0]}, poses),
        lambda: sweep(cables, {"payload_kg": [1.0]}, poses),
        lambda: sweep(cables, {"payload": [1.0]}, poses, payload_at=[0.0, 0.0, -0.5], joint=True),
        lambda: sweep(cables, {"scale": [1.0]}, poses, joint=True, load=ep.Load([0.0, 0.0, -1.0])),
        lambda: sweep(cables, {"scale": [1.0]}, poses, limits="weak"),
        lambda: sweep("four-cables", {"scale": [1.0]}, poses),
        lambda: adl_box(0.499),
        lambda: [adl_box(step, side).shape for step, side in ((7.0, "right"), (35.0, "left"), (111.0, "left"))],
        lambda: adl_box(52.0, "right"),
        lambda: compare(cables, poses),
        lambda: compare(cables, "six", poses=poses),
        lambda: compare(cables, muscles, poses=poses, detailed=True, centre_offset=[0.0, 0.0, 0.01]),
        lambda: compare(cables, muscles, poses=poses, joint=True, motion=ep.Motion([1.0, 0.0, 0.0], [0.0, 0.0, 0.0])),
        lambda: compare(muscles, *named("optimised-table-c-2", "appendix-d"), poses=poses),
        lambda: compare(cables.replace(arm=None), muscles.replace(arm=None), poses=poses),
        lambda: evaluate(cables, poses[:0]),
        lambda: evaluate(3, poses),
        lambda: non_dominated(rows),
        lambda: non_dominated(rows, ["a"], ["b"]),
        lambda: non_dominated(rows, ["a", "b"]),
        lambda: non_dominated({"a": [1.0, 1.0, 2.0], "b": [5.0, 5.0, 7.0]}, [], ["a", "b"]),
        lambda: non_dominated(StudyTable([row(0.1, 0.1, 3.0)]), ["can_holds"]),
        lambda: StudyTable([row(0.1, 0.1, 3.0)]).peak,
        lambda: StudyTable([{"a": 1.0}]).peak,
        lambda: StudyTable([{"a": 1.0}, {"a": 1.0, "b": 2.0, "c": 0.0}]),
        lambda: StudyTable([{"a": 1.0}], "one head"),
        lambda: StudyTable({"a": [1.0]}),
    )  # fmt: skip


def on_one_arm():
    """Whose arm it is, in words: of nobody, of the first that has one, of another side, with weight in the hand."""
    cables, muscles = ep.load("four-cables"), ep.load("prototype")
    poses = few(cables)
    own = muscles.replace(name="other", gravity=[0.0, 2.0, -9.5])
    lifted = cables.replace(arm=cables.arm + ep.Arm(1.0, [0.0, 0.1, -0.5], np.zeros((3, 3))))
    nobody = cables.replace(arm=ep.Arm(3.1, [0.0, 0.01, -0.2]))
    slightly = [cables.worn_by(ep.Wearer(1.7, 70, "female", elbow_flexion=bend, degrees=True)) for bend in (0.04, 0.06)]
    tables = [
        compare(*pair, poses, limits="none")
        for pair in (
            (muscles, own),
            (muscles, cables, own.mirrored()),
            (cables.mirrored(), muscles, named("six-cables")[0]),
            (lifted, muscles),
            (nobody, muscles),
            (slightly[0], muscles),
            (slightly[1], muscles.mirrored()),
        )
    ]
    tables += [compare(cables, muscles, poses=poses, person=nobody.arm), compare(cables, own, poses=poses, person=MAN)]
    return [(table.heading, table.verdict, table["peak_F_s_N"], table["one_side"]) for table in tables]


def beyond():
    """Where some devices do not go, and nobody's arm: no figure is known of many, each with its reason."""
    arm = ep.Arm(4.1, [0.01, 0.0, -0.27], np.diag([0.1, 0.1, 0.004]))
    return compared(
        "serial-y-x-z", "four-cables", "spring-support", detailed=True, person=arm,
        poses=ep.load("four-cables").pose(60.0, 95.0, 10.0),
    )  # fmt: skip


def unreached():
    """Slides that come to no pose."""
    arm = ep.Arm(4.1, [0.01, 0.0, -0.27], np.diag([0.1, 0.1, 0.004]))
    slides, cables = named("3rps-passive-ball", "four-cables")
    table = compare(slides, cables, poses=cables.pose(162.0, -32.0, 82.0), person=arm, detailed=True)
    return [table[name] for name in ("reach", "effort_N", "stroke_mm", "stroke_deg", "blank")]


def of_limits():
    """What is left after a failure with limits of a question, of one pose and of several."""
    four, three = named("four-linear-actuators", "three-linear-actuators")
    poses = few(four, 2)
    found = [
        compare(four, three, poses=each, person=ep.Arm(4.1, [0.01, 0.0, -0.27]), detailed=True, limits=limits)
        for each, limits in (
            (poses[0], "pull"),
            (poses, "none"),
            (poses, (-20.0, 150.0)),
            (poses[0], np.array([-20.0, 150.0])),
        )
    ]
    names = (
        "held_after_failure",
        "effort_N",
        "effort_share",
        "stroke_mm",
        "median_margin",
        "change_by_10_mm_N",
        "blank",
    )
    return [[table[name] for name in names] for table in found]


def without_data():
    """A spring whose data end in one pose only off the centre, and in the other one too."""
    way = Route.over(("universe", (0.0, 0.0, -0.4)), ("arm", (0.0, 0.0, -0.2)))
    springs = [Spring("n", TableLaw((low, 0.9), (-30.0, -10.0)), route=way) for low in (0.285, 0.31)]
    pair = [
        ep.load(URDF / "spring-support.urdf").replace(springs=[own], name=f"n{own.law.range[0]}") for own in springs
    ]
    table = compare(*pair, poses=pair[0].pose([43.5, 50.0], [0.0, 4.0], 15.0), detailed=True)
    names = ("not_evaluated", "follows_10_mm", "change_by_10_mm_N", "change_on_cuff_N", "left_to_wearer", "blank")
    return [table[name] for name in names]


def overloaded():
    """A hand so heavy that the wearer's muscles hold none of the poses."""
    pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    four, lifted = ep.load("four-cables"), ep.Wearer(1.755, 85, "male", payload=60.0)
    table = compare(*named("spring-support"), four, poses=few(four)[:2], person=lifted, joint=True, detailed=True)
    return str(table), table["blank"]


#: Those that are held, passive, beyond reach and without an actuator, side by side.
FOUR = ("prototype", "four-cables", "serial-y-x-z", "spring-support")
KINDS = ("spring-support", "3rps-passive-ball", "serial-y-x-z", "appendix-d", "prototype")

ASKED = {
    "four_kinds": lambda: compared(*FOUR, detailed=True, poses=few(ep.load("four-cables"), shape=(3, 1))[:2]),
    "ranks": ranked,
    "table_in_all_forms": written,
    "sweeps": sweeps,
    "refusals": refusals,
    "on_one_arm": on_one_arm,
    "beyond": beyond,
    "unreached": unreached,
    "of_limits": of_limits,
    "overloaded": overloaded,
    "without_data": without_data,
    "kinds": lambda: compared("four-cables", *KINDS, poses=few(ep.load("four-cables"), 4, (2, 2))),
}


#: Those that take longer than 0.15 s.
LONGER = {"four_kinds", "unreached", "of_limits", "overloaded", "beyond", "without_data"}


@each_of(ASKED, LONGER)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
