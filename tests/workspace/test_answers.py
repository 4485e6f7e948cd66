"""Answers of workspaces, of the lists of limbs and parts, of tasks and days, of searches and checks, as stored."""

import contextlib
import io
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from answers import changes, each_of
from asked_in_turn import refused
from places import URDF

import exo_pin as ep
from exo_pin.cli import main
from exo_pin.design import preset
from exo_pin.device import Drive, Route
from exo_pin.load_case import RangeOfMotion
from exo_pin.workspace import (
    CRITERIA,
    day_reach,
    free_joints,
    lifting_poses,
    limb_loss,
    limb_sheet,
    limb_table,
    population,
    recheck,
    starting_design,
    task_reach,
    workspace,
)
from exo_pin.workspace.limb_table import limb_loss_words

MAN = ep.Wearer(1.755, 85, "male", elbow_flexion=0.6, payload=0.5)
WOMAN = ep.Wearer(1.60, 55, "female")
#: Whose hands do not get everywhere.
STOUT = ep.Wearer(1.3, 140, "female")
FACING = ep.glenoid_orientation(35.0, 8.0, 5.0, retroversion=4.0, inclination=6.0, degrees=True)
#: All that can be limited, each so that some poses meet it and some do not.
LIMITED = ep.Criteria(
    least_margin=0.2, least_tension=6.0, least_moment=1.5, largest_shoulder_force=70.0, largest_pull_out=12.0,
    socket=ep.GlenoidCone(orientation=FACING), largest_cuff_pull=40.0, largest_cuff_slip=0.012, least_above_elbow=0.03,
    least_moment_without_limb=0.1, least_rate=0.04, least_twin_angle=0.3, least_gap=0.02, obstacles=("chair",),
)  # fmt: skip


def load(name):
    return ep.load(URDF / f"{name}.urdf" if (URDF / f"{name}.urdf").exists() else name)


def few(exo):
    """Poses without a symmetry."""
    return exo.pose([20.0, 75.0, 40.0, 5.0], [35.0, 10.0, 70.0, 20.0], [-10.0, 25.0, 5.0, -60.0])


def grid(exo, low=10.0):
    """A small grid of three angles."""
    angles = np.meshgrid([low, 55.0, 100.0], [5.0, 40.0], [-35.0, 15.0, 40.0], indexing="ij")
    return ep.shoulder_rotation(*angles, side=exo.side, degrees=True)


def told(found):
    """All that is said of a workspace."""
    nearest = np.unravel_index(found.poses.magnitude().argmin(), found.inside.shape)
    region = nearest, found.region_distance, float(found.region.mean())
    return str(found), found.summary(), found.columns(), found.tensions, found.gaps, region


def limited():
    """All criteria with their limits, of two wearers, off centre and with a load, on a right shoulder."""
    exo = load("four-linear-actuators-worn").worn_by(MAN).mirrored()
    soft = exo.replace(interfaces=ep.Interfaces(cuff=ep.Interface.upper_arm_cuff(0.19)))
    limits = LIMITED.replace(wearers=(MAN, WOMAN), elbow_range=(0.2, 1.3), stroke_rule="not all short")
    load_ = ep.Load([0.0, 3.0, -6.0], at=[0.0, 0.0, -0.2])
    off = ep.CentreOffset([0.011, 0.0, -0.004], [0.0, 0.006, 0.002])
    found = workspace(soft.mechanism, grid(soft), limits, load_, off)
    few_criteria = workspace(soft.mechanism, grid(soft), ["stroke"], None, off)
    costs = found.one_by_one(["forces", "stroke", "clearance"])
    return [
        *told(found),
        {**costs},
        {**limb_table(soft.mechanism, few_criteria)},
        limb_loss(soft.mechanism, few_criteria),
        few_criteria.gaps[0, 0],
    ]


def of_kinds():
    """What is checked of each kind in a few poses, and what is found."""
    found = {}
    for name in ("four-cables", "four-muscle-cables", "prototype", "appendix-d", "3rps-passive-ball", "spring-support"):
        exo = load(name)
        at = workspace(exo.device, few(exo), LIMITED.replace(obstacles=(), least_twin_angle=None))
        found[name] = at.margins, at.not_checked, at.magnitude, str(at)
    own = ep.load("prototype").mechanism
    ways = ((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (0.6, 0.0, -0.8))
    limbs_ = [replace(limb, joint_straight=way) for limb, way in zip(own.limbs, ways, strict=True)]
    for turned in (limbs_, limbs_[1:2] * 3):
        bent = workspace(own.replace(limbs=turned), few(ep.load("prototype")), ["joint_angles"])
        found[str(len(found))] = bent.margins, bent.gaps[0], bent.tensions[0]
    return found


def levers():
    """Distances to the ends of the strokes of hinges and of a cable beside them, and of slides, by both rules."""
    hinges, slides = load("serial-y-x-z"), load("3rps-passive-ball")
    way = Route.over(("universe", [0.0, 0.2, 0.3]), (hinges.chain.roles.arm, [0.0, 0.02, -0.25]))
    cable = Drive("cable", route=way, upper=60.0, stroke=ep.Stroke(0.4, 0.3, 1.0, 0.2))
    mixed = hinges.replace(drives=[*hinges.device.drives, cable])
    rules = [ep.Criteria(("stroke",), stroke_rule=rule) for rule in ("each", "not all short")]
    found = [exo.workspace(few(exo), rule) for exo in (mixed, slides) for rule in rules]
    return [(each.margins["stroke"], each.units, each.lengths) for each in found]


def chosen():
    """What of the criteria is asked of each kind, with and without limits."""
    kinds = ("four-cables", "prototype", "optimised-table-c-2", "serial-y-x-z", "spring-support", "3rps-passive-ball")
    bare = load("four-cables").replace(limbs=None)
    sure = [load(name).device for name in kinds] + [bare.device, bare.replace(arm=None).device]
    free = LIMITED.replace(obstacles=())
    return [
        {name: criterion.missing(design, free, False) for name, criterion in CRITERIA.items()} for design in sure
    ] + [
        *(ep.Criteria().chosen(design, True) for design in sure),
        # Columns are named after drives, in stacks of any shape.
        list(load("four-cables").workspace(grid(load("four-cables")), ["stroke"]).columns()),
        [list(load(name).workspace(few(load(name)), ["singularity"]).columns()) for name in kinds[3:]],
    ]


def criteria():
    """What each criterion is called, drawn in and weighed by."""
    return {
        name: (own.unit, own.words, own.colour, own.scale(LIMITED) if callable(own.scale) else own.scale, own.aim,
               own.most, own.limit, own.is_vital)
        for name, own in CRITERIA.items()
    }  # fmt: skip


def refusals():
    exo, cables = load("four-linear-actuators-worn"), load("four-cables")
    held = exo.workspace(few(exo), ["forces"])
    lacking = (
        "joint_angles",
        "clearance",
        "connected",
        "forces",
        "socket",
        "cuff_slip",
        "elbow",
        "evaluated",
        "accuracy",
    )
    bare = cables.replace(arm=None, limbs=None)
    return refused(
        *(lambda name=name: workspace(bare.device, few(exo), [name]) for name in lacking),
        lambda: workspace(exo.device, few(exo)[:0]),
        lambda: workspace(exo.device, few(exo), ["strokes"]),
        lambda: workspace(exo.device, few(exo), "stroke"),
        lambda: workspace(exo.device, True),
        lambda: ep.Criteria(least_margin=-0.1),
        lambda: ep.Criteria(least_twin_angle=0.0),
        lambda: ep.Criteria(socket=3.0),
        lambda: ep.Criteria(largest_pull_out=-1.0),
        lambda: ep.Criteria(stroke_rule="some"),
        lambda: ep.Criteria(wearers=("a man",)),
        lambda: ep.Criteria(wearers=MAN, names=(n for n in ("forces", "stroke"))),
        lambda: ep.Criteria(obstacles="chair", body=ep.BodyShape.of(MAN)),
        lambda: ep.Criteria(obstacles="tree"),
        lambda: ep.Criteria(elbow_range=(1.0, 0.2)),
        lambda: ep.Criteria(elbow_range=(0.0, 1.0)).arms(bare.device),
        lambda: ep.Criteria(obstacles="door").body_of(bare.device),
        lambda: [arm.mass for arm in ep.Criteria(elbow_range=(0.0, 1.6)).arms(exo.mechanism)],
        lambda: [arm.centre_of_mass for arm in ep.Criteria(wearers=(MAN, WOMAN)).arms(exo.mechanism)],
        lambda: held.region,
        lambda: held.one_by_one(["stroke"]),
        lambda: limb_table(load("spring-support").device, held),
        lambda: limb_table(load("prototype").device, held),
        lambda: limb_loss(exo.device, exo.workspace(few(exo), ep.Criteria(("singularity",), least_margin=0.999))),
        lambda: task_reach(exo.device, ranges=()),
        lambda: task_reach(exo.device, ranges=["eating"]),
        lambda: population([], [MAN]),
        lambda: population(["a design"], [MAN]),
        lambda: ep.optimise(exo, {"A[1].radius": (0.1, 0.2)}, centre_offset=np.zeros((2, 3))),
        lambda: population([exo], ["a man"]),
        lambda: day_reach(load("prototype")),
        lambda: day_reach(exo, step=-1.0),
        lambda: day_reach(exo, ep.Criteria(obstacles="door")),
        lambda: starting_design(ep.Actuator("cable", pull_limit=90.0), None, 2),
        lambda: free_joints(0),
        lambda: free_joints(1001),
        lambda: recheck(exo.device, 3, ep.Criteria()),
        lambda: recheck(exo.device, exo.reaction, ["stroke"]),
    )  # fmt: skip


def limbs():
    """Tables of limbs and of drives, what is left without one, and the sheets of a workshop."""
    found = []
    for name, criteria in (
        ("four-linear-actuators-worn", ep.Criteria(("forces", "clearance"), wearers=(MAN, WOMAN))),
        ("four-cables", ep.Criteria(("forces",), least_tension=4.0)),
        ("serial-y-x-z", ep.Criteria(("forces",))),
        ("3rps-passive-ball", ep.Criteria(("singularity",))),
    ):
        exo = load(name)
        at = exo.workspace(few(exo), criteria)
        table = limb_table(exo.device, at)
        loss = limb_loss(preset(name) if name.startswith("four") else exo.device, at)
        found.append(({**table}, {**loss}, limb_sheet(exo.device, table), at.index, limb_loss_words(loss)))
    return found


def day(name, side, criteria, step, wearer=MAN):
    exo = load(name).worn_by(wearer)
    found = day_reach(exo if side == "left" else exo.mirrored(), criteria, step)
    return found, found.summary(), found.columns()


def tasks():
    """Of movements and published ranges, of limbs whose speed and power are limited, of drives in hinges."""
    linear, cables, serial = load("four-linear-actuators-worn"), load("four-cables"), load("serial-y-x-z")
    slow = replace(linear.limbs[0].actuator, speed_limit=0.2, power_limit=15.0)
    fast = replace(linear.limbs[0].actuator, speed_limit=0.3)
    limbs_ = [replace(limb, actuator=slow if k % 2 else fast) for k, limb in enumerate(linear.limbs)]
    times = np.linspace(0.0, 1.2, 7)
    lift = ep.Movement.from_samples(times, linear.pose(80.0 * times, 20.0 * times**2, -15.0 * times), smoothing=None)
    ranges = [
        RangeOfMotion("near", (0.0, 40.0), (10.0, 30.0), (-20.0, 10.0)),
        RangeOfMotion("far", (60.0, 150.0), (0.0, 80.0), (-70.0, 0.0)),
    ]
    tables = [
        task_reach(linear.replace(limbs=limbs_).device, {"lift": lift}, ranges, step=25.0),
        task_reach(
            linear.replace(limbs=[replace(limb, actuator=fast) for limb in linear.limbs]).device,
            {"lift": lift},
            [],
            ["forces", "stroke"],
        ),
        task_reach(cables.device, {"lift": lift}, [], ["forces", "stroke", "connected"]),
        task_reach(serial.device, {"lift": lift}, ranges[:1], ["forces", "stroke"], step=20.0),
        population([linear, cables], [MAN, WOMAN], few(linear), ep.Criteria(("forces", "stroke", "clearance"))),
        population([cables], [WOMAN], grid(cables), ep.Criteria(("stroke", "singularity"))),
        population([linear], [MAN, WOMAN], 45.0, ep.Criteria(("connected", "stroke"), least_margin=0.3)),
    ]
    return [{**table} for table in tables]


def checks():
    """Designs on coarse grids, for other persons and elsewhere, through Pinocchio where they are wrists."""
    linear, serial = load("four-linear-actuators-worn"), load("serial-y-x-z")
    off = ep.CentreOffset([0.011, 0.0, -0.004], [0.0, 0.006, 0.002])
    found = [
        recheck(linear.device, linear.reaction, ep.Criteria(wearers=(MAN,), least_gap=0.01), 40.0, off, 35.0),
        recheck(linear.device, linear.reaction, ep.Criteria(largest_shoulder_force=90.0), 55.0, None, 45.0),
        recheck(serial.device, serial.reaction, ep.Criteria(("stroke", "singularity")), 60.0, step=50.0),
    ]
    words = [[line for line in str(each).splitlines() if "Checked with Pinocchio" not in line] for each in found]
    return [
        (text, each.works, each.finer_index, each.pinocchio_poses, each.pinocchio_difference < 1e-6, each.persons,
         each.offsets, each.beyond_elbow, each.flexion.index, each.abduction.index)
        for text, each in zip(words, found, strict=True)
    ]  # fmt: skip


def searched(exo, variables, objectives="index", poses=None, names=("forces", "stroke"), **options):
    """What a search of few designs finds, and its words without the last digits of its check."""
    chosen = lifting_poses(exo.side, counts=(2, 2, 2)) if poses is None else poses
    given = {"seed": 3, "budget": 24, "run_length": 24, "step": 50.0, "finer_step": 60.0} | options
    found = ep.optimise(
        exo, variables, chosen, objectives, ep.Criteria(names) if isinstance(names, tuple) else names, **given
    )
    words = [line for line in str(found).splitlines() if "Checked with Pinocchio" not in line]
    design = found.best.device
    strokes = (
        [
            (limb.stroke and (limb.stroke.nominal_length, limb.stroke.shortest, limb.stroke.longest))
            for limb in getattr(found.best, "limbs", ())
        ]
        if design.accelerate("workspace")
        else None
    )
    return found.runs, found.values, words, found.spread, found.evaluations, strokes  # fmt: skip


def searches_of_wrists():
    """By the index in two runs, from the design itself, by several objectives, off centre, with a cuff of its own."""
    pytest.importorskip("cmaes", reason="needs the extra optimise")
    cables, linear = load("four-cables"), load("four-linear-actuators-worn")
    joints = {"A[1].radius_mm": (100.0, 220.0), "A[2].elevation_deg": (-60.0, 60.0), "B[1].azimuth": (-np.pi, np.pi)}
    off = ep.CentreOffset([0.011, 0.0, -0.004], [0.0, 0.006, 0.002])
    limited = LIMITED.replace(names=("stroke", "forces", "shoulder_force", "singularity", "accuracy"), least_moment=0.0)
    return [
        searched(cables, joints, budget=48),
        searched(linear, {"A[1].radius": (0.2, 0.6), "B[2].drop": (0.03, 0.2)}, "mean_shoulder_force", refine=True),
        searched(linear, joints, ("index", "device_mass"), names=limited, cuff_by_geometry=True, budget=48),
        searched(linear, joints, "weakest_rate", names=("singularity",), fit_strokes=False, centre_offset=(None, off)),
        searched(cables, joints, ("peak_shoulder_force", "median_moment_margin"), linear.pose([0.0, 40.0], 10.0)),
        searched(cables, joints, ("device_mass", "mean_shoulder_force"), budget=72),
        searched(cables, joints, "worst_margin", names=("singularity", "forces")),
    ]  # fmt: skip


def searches_of_others():
    """Of muscles whose pull hangs on their length, and of a robot's links."""
    pytest.importorskip("cmaes", reason="needs the extra optimise")
    muscles, legs = load("four-muscle-cables"), load("3rps-passive-ball")
    return [
        searched(muscles, {"nominal_length[1]": (0.3, 0.6), "A[2].radius": (0.1, 0.2)}, poses=few(muscles)),
        searched(muscles, {"A[3].radius": (0.1, 0.2)}, poses=few(muscles), names=None),
        searched(legs, {"joint[cuff_slide].z_m": (-0.2, -0.18)}, poses=few(legs), names=("singularity",), step=90.0),
    ]


def refused_searches():
    pytest.importorskip("cmaes", reason="needs the extra optimise")
    cables, poses = load("four-cables"), few(load("four-cables"))
    free = {"A[1].radius": (0.1, 0.2)}
    stack = ep.CentreOffset(np.zeros((4, 3)), np.zeros((4, 3)))
    search = partial(ep.optimise, budget=24, step=60.0, finer_step=60.0)
    return refused(
        lambda: search(cables, {}, poses),
        lambda: search(cables, free, poses, ()),
        lambda: search(cables, free, poses, "force"),
        lambda: search(cables, free, poses, budget=True),
        lambda: search(cables, free, poses, budget=0),
        lambda: search(cables, free, poses, run_length=2.0),
        lambda: search(cables, free, poses, "contact_force"),
        lambda: search(cables, free, poses, person="a man"),
        lambda: search(cables, free, poses[:0]),
        lambda: search(cables, free, [1.0, 2.0]),
        lambda: search(cables, free, poses, name=""),
        lambda: search(cables, free, poses, centre_offset=()),
        lambda: search(cables, free, poses, centre_offset=stack),
        lambda: search(cables, {"A[1].radius": (0.02, 0.03)}, poses, refine=True),
        lambda: search(cables, free | {"A[1].radius_mm": (100.0, 200.0)}, poses),
        lambda: search(cables, {"A[1].radius": (0.2, 0.1)}, poses),
        lambda: search(cables, {"end_fitting[1]": (0.02, 0.1)}, poses),
        lambda: search(cables, {"r_A": (0.02, 0.1)}, poses),
        lambda: search(cables, free, poses, storage="/no/such/folder/study.db"),
        lambda: search(cables, free, poses, storage=3),
        lambda: search(load("appendix-d"), free, poses),
    )


def ran(*arguments):
    """What a command prints, and its errors, without the last digits of a check."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        status = main([str(each) for each in arguments])
    return status, [line for line in out.getvalue().splitlines() if "with Pinocchio" not in line], err.getvalue()


def commands():
    """Which joints a command searches, and what it says of a lost limb."""
    pytest.importorskip("cmaes", reason="needs the extra optimise")
    small = ("--budget", 24, "--run-length", 24, "--step", 60.0)
    return [
        ran("optimise", URDF / "serial-y-x-z.urdf", *small),
        ran("optimise", URDF / "serial-y-x-z.urdf", "--drop", "80:200", "--vary", "scale=0.9:1.1", *small),
        ran("optimise", "four-cables", "--refine", "--base-radius", "100:300", "--drop", "60:290", "--vary",
            "B[1].drop_mm=70:300", *small),
        ran("optimise", "four-cables", "--refine", "--vary", "A[1].radius_mm=200:300", *small),
        ran("optimise", "--limbs", 3, "--family", "linear", "--pull", 500, "--push", 150, "--travel", 180, "--person",
            "1.7,66,female", *small),
        *(ran("workspace", name, "--limb-loss", "--one-by-one", "--step", 45, "--no-muscles")
          for name in ("four-cables", "four-linear-actuators", "six-cables")),
    ]  # fmt: skip


ASKED = {
    "commands": commands,
    "searches_of_wrists": searches_of_wrists,
    "searches_of_others": searches_of_others,
    "refused_searches": refused_searches,
    "limited": limited,
    "of_kinds": of_kinds,
    "levers": levers,
    "chosen": chosen,
    "criteria": criteria,
    "refusals": refusals,
    "limbs": limbs,
    "day": lambda: day("four-linear-actuators-worn", "left", ["forces", "clearance", "stroke"], 40.0),
    "day_of_a_stout_person": lambda: day("four-linear-actuators-worn", "left", ["stroke"], 72.0, STOUT),
    "day_of_a_right_arm": lambda: day("four-cables", "right", ["stroke", "forces"], 72.0, WOMAN),
    "tasks": tasks,
    "checks": checks,
}

#: Those that take longer than 0.15 s.
LONGER = {"commands", "limited", "searches_of_wrists", "searches_of_others", "checks"}


@each_of(ASKED, LONGER)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
