"""Every sort of figure, small: what their stored descriptions are made from."""

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
from places import URDF

import exo_pin as ep
from exo_pin import control, muscle
from exo_pin.device import Route, Spring, TableLaw
from exo_pin.study import StudyTable
from exo_pin.view import plots
from exo_pin.view.plots.angle_maps import front_figure
from exo_pin.view.plots.muscle_plots import plot_motion

MAN = ep.Wearer(1.75, 75, "male", elbow_flexion=0.8)
NAN, FREE = np.nan, {"limits": "none"}


@cache
def prototype():
    return ep.load("prototype").worn_by(ep.Arm.from_anthropometry(1.75, 75, "male"))


@cache
def worn(side="left"):
    return ep.load("four-linear-actuators-worn", side=side).worn_by(MAN)


@cache
def robot(name):
    return ep.load(URDF / f"{name}.urdf").worn_by(MAN)


@cache
def lift():
    return prototype().reaction(prototype().pose(np.arange(0.0, 91.0, 3.0), 30.0), **FREE)


@cache
def movement(side="left"):
    times, exo = np.linspace(0.0, 2.0, 21), worn(side)
    return exo.follow(ep.Movement.from_samples(times, exo.pose(30 + 20 * times, 10 + 10 * times, 5 * times)))


@cache
def workspace(gap):
    return ep.load("four-cables").workspace(gap, ["forces", "stroke", "singularity"])


def folded_workspace():
    """Over a grid that begins beyond 90° of abduction, where angles of poses fold back."""
    exo = ep.load("four-cables")
    angles = np.arange(-30.0, 91.0, 30.0), np.array([100.0, 125.0, 150.0]), np.array([60.0, 10.0, -40.0])
    return exo.workspace(exo.pose(*np.meshgrid(*angles, indexing="ij")))


def sprung(longer=0.0):
    """A robot with a spring whose table begins at 285 mm, or so many m later."""
    route = Route.over(("universe", (0.0, 0.0, -0.4)), ("arm", (0.0, 0.0, -0.2)))
    lengths = (0.285 + longer, 0.4 + longer, 0.9 + longer)
    strut = Spring("strut", TableLaw(lengths, (-30.0, -20.0, -10.0)), route=route)
    return ep.load(URDF / "serial-y-x-z.urdf").replace(springs=[strut], name="helped")


def weightless():
    return ep.load("prototype").replace(arm=ep.Arm(3.0, [0.0, 0.0, -0.3]))


def pose_minimal():
    exo = prototype()
    answer = exo.reaction(exo.pose(60, 30), split="minimal", constraint_bounds=(-80, 80), **FREE)
    return answer.plot(limits=(0.0, [400.0, 300.0, np.inf]))


def singular_pose():
    return prototype().reaction(prototype().pose(0, 90)).plot()


def one_pose():
    return worn().reaction(worn().pose(60, 20)).plot(limits=(-np.inf, [300.0, np.inf, 200.0, 100.0]))


def lifted(**more):
    return lift().plot(np.arange(0.0, 91.0, 3.0), "flexion, °", **more)


def stack_without_answer():
    exo = sprung()
    return exo.reaction(exo.pose([0.0, 20.0, 60.0, 90.0])).plot([0.0, 20.0, 60.0, 90.0], "flexion, °")


def not_held():
    exo = ep.load("three-linear-actuators", side="right")
    return exo.reaction(exo.pose(np.linspace(0.0, 120.0, 13), 95.0)).plot()


def limited():
    """Of each limb its own limits, of which some are infinite."""
    return lifted(limits=([-10.0, -20.0, -np.inf], [50.0, np.inf, 70.0]))


def uncertainty(name, *angles):
    exo = ep.load(name)
    return exo.uncertainty(exo.pose(*angles)).plot()


def total_uncertainty():
    exo = ep.load("four-linear-actuators-worn")
    return exo.total_uncertainty(exo.pose(60, 30), draws=24, seed=3).plot()


ROWS = [
    {"design": "weak", "can_hold": 0.0, "holdable": 0.0, "common_peak_F_s_N": NAN, "peak_F_s_N": NAN},
    {"design": "good", "can_hold": 0.5, "holdable": 0.9, "common_peak_F_s_N": 120.0, "peak_F_s_N": 150.0},
    {"design": "best", "can_hold": 0.9, "holdable": 0.9, "common_peak_F_s_N": 60.0, "peak_F_s_N": 70.0},
    {"design": "half", "can_hold": 0.4, "holdable": 0.4, "common_peak_F_s_N": NAN, "peak_F_s_N": 90.0},
    {"design": "free", "can_hold": 0.0, "holdable": 0.0, "common_peak_F_s_N": 30.0, "peak_F_s_N": NAN},
]
CONTACT = {"contact_N": [NAN, 90.0, 50.0, NAN, 80.0], "contact_without_N": [200.0, 210.0, 205.0, NAN, 199.0]}
DETAILED = {
    "design": ["a", "b", "c"],
    "holdable": [0.5, 1.0, 0.0], "can_hold": [0.5, 1.0, 0.0], "held_after_failure": [0.25, NAN, 0.0],
    "clear": [0.75, 1.0, 0.5], "singular": [0.0, 0.1, 0.2], "not_evaluated": [0.25, 0.0, 0.0],
    "median_F_s_N": [40.0, 30.0, NAN], "peak_F_s_N": [90.0, 400.0, NAN], "common_peak_F_s_N": [90.0, 60.0, NAN],
    "contact_N": [100.0, 80.0, NAN], "peak_contact_N": [150.0, 120.0, NAN], "contact_without_N": [300.0, 290.0, 310.0],
    "change_by_10_mm_N": [5.0, 150.0, NAN], "change_on_cuff_N": [2.0, 1.0, NAN], "follows_10_mm": [1.0, 0.5, 0.0],
    "effort_share": [0.2, 0.6, NAN], "effort_N": [200.0, NAN, NAN], "effort_Nm": [NAN, 12.0, NAN],
    "stroke_mm": [120.0, NAN, NAN], "stroke_deg": [NAN, 80.0, NAN],
    "mass_on_arm_kg": [0.5, 0.7, NAN], "mass_of_links_kg": [1.5, NAN, NAN],
}  # fmt: skip


def ranking(joint):
    contact = [{name: values[k] for name, values in CONTACT.items()} if joint else {} for k in range(len(ROWS))]
    rows = [{"rank": 1} | row | more for row, more in zip(ROWS, contact, strict=True)]
    return StudyTable(rows, ["Five designs", "in one pose"]).plot()


def detailed(**other):
    names = DETAILED | other
    return StudyTable([{name: names[name][k] for name in names} for k in range(3)], ["Three devices"]).plot()


def table(*names, rows, figure="peak_F_s_N"):
    return StudyTable([dict(zip((*names, figure), row, strict=True)) for row in rows]).plot(figure)


def search(names, start=True):
    values = [
        dict(zip(("index", "mean_shoulder_force"), pair, strict=True))
        for pair in ((0.5, 40.0), (0.8, 60.0), (0.6, 70.0))[: 3 if start else 1]
    ]
    runs = [SimpleNamespace(merit=-0.1 * k) for k in range(len(values))]
    front = [SimpleNamespace(run=runs[k], objectives=values[k]) for k in ((1, 0) if start else (0,))]
    first = SimpleNamespace(run=runs[2], objectives=values[2]) if start else None
    return front_figure(
        SimpleNamespace(objectives=names, runs=runs, values=values, front=front, start=first, evaluations=30)
    )


def driven(name, fault=None, controller="model"):
    faults = {} if fault is None else {"faults": [control.Fault(fault, 1, start=0.2)]}
    return ep.load(name).track("abduction", controller, duration=0.4, **faults).plot()


#: Through the angle at which two of the three turn about one axis.
RAISED = control.AnglePath([0.0, 0.1], np.radians([[5.0, 80.0, 10.0], [5.0, 88.0, 10.0]]), title="raised to 88 degrees")


def both():
    """Three limbs with muscles and one with a motor."""
    exo = ep.load("four-muscle-cables")
    return exo.replace(limbs=[*exo.limbs[:3], ep.load("four-cables").limbs[3]])


def loop():
    names = ("time_s", "wanted_mm", "contraction_mm", "pressure_bar", "duty")
    return plot_motion({name: np.arange(5.0) + k for k, name in enumerate(names)})


def elbows():
    times = np.linspace(0.0, 1.0, 9)
    lifts = {"lift": ep.shoulder_rotation(60 * times, 0, 0, degrees=True)}
    lifts["side"] = ep.shoulder_rotation(0, 60 * times, 0, degrees=True)
    return plots.elbow_paths_figure({name: ep.Movement.from_samples(times, poses) for name, poses in lifts.items()})


def day():
    exo = ep.load("four-linear-actuators-worn")
    return plots.day_figure(ep.workspace.day_reach(exo, ["forces", "stroke"], step=45.0))


def contact_box(name, least=0.0):
    box = (np.array([least, 40.0, 80.0]), np.array([least / 2, 50.0]), np.array([-10.0, 10.0, 150.0]))
    person, grid = ep.Person(1.75, 75, "male"), np.meshgrid(*box, indexing="ij")
    poses = ep.shoulder_rotation(*grid, degrees=True)
    subject = person if name is None else ep.load(name)
    more = {} if name is None else {"person": person}
    return plots.contact_over_box(box, subject.joint_contact(poses, outside="mark", **more))


def contact_lift(device):
    degrees, person = np.array([20.0, 40.0, 60.0, 90.0]), ep.Person(1.75, 75, "male")
    poses = ep.shoulder_rotation(0, degrees, 0, degrees=True)
    contact = ep.load("prototype").joint_contact(poses, person)
    return plots.contact_over_elevation(degrees, contact if device else contact.without_device).figure


def drawing(side):
    exo = ep.load("four-cables", side=side).worn_by(MAN)
    return plots.design_drawing(exo, exo.pose(60.0, 20.0), 1.2 if side == "left" else None)


def determinant_map(name, side):
    return plots.determinant_map(ep.load(name, side=side), None, 30.0, 10.0).figure


def overview():
    exo = prototype()
    return plots.overview(exo, exo.pose(60, 30), exo.reaction(exo.pose(60, 30), split="standalone"))


def force_map(exo, **options):
    return plots.shoulder_force_map(exo, **options).figure


def postures(exo, *angles):
    flexion, abduction = np.transpose(angles)
    return plots.posture_drawing(exo, exo.pose(flexion, abduction), [f"posture {k}" for k in range(len(angles))])


def thick():
    """A robot of which one link alone has a shape, which is thicker than lines are drawn."""
    chain = ep.load(URDF / "serial-y-x-z.urdf").chain
    shape = next(each for each in chain.description.shapes if each.frame == "link_2")
    description = replace(chain.description, shapes=(replace(shape, size=(0.06, *shape.size[1:])),))
    return ep.ShoulderExo.from_chain(ep.ClosedChain(chain.model, description)).worn_by(MAN)


#: Figures by name.
FIGURES = {
    "pose": one_pose,
    "pose_minimal": pose_minimal,
    "pose_singular": singular_pose,
    "pose_serial": lambda: robot("serial-y-x-z").reaction(robot("serial-y-x-z").pose(40, 20)).plot(),
    "stack": lambda: lifted(limits=(0.0, 200.0)),
    "stack_cut": lifted,
    "stack_near": lambda: prototype().reaction(prototype().pose(np.linspace(5.5, 6.6, 12), 30.0), **FREE).plot(),
    "stack_limits": limited,
    "stack_right_not_held": not_held,
    "stack_no_data": stack_without_answer,
    "movement_time": lambda: movement().plot(),
    "movement_right_abduction": lambda: movement("right").plot("abduction", "right", (-50.0, 300.0)),
    "movement_flexion": lambda: movement().plot("flexion"),
    "movement_internal": lambda: movement().plot("internal_rotation"),
    "uncertainty": lambda: uncertainty("four-cables", 60, 30),
    "uncertainty_no_bound": lambda: uncertainty("prototype", 7, 30),
    "total_uncertainty": total_uncertainty,
    "ranking": lambda: ranking(False),
    "ranking_joint": lambda: ranking(True),
    "ranking_none": lambda: StudyTable([{"rank": 1} | row for row in ROWS[:1] * 2]).plot(),
    "comparison": detailed,
    "comparison_all": lambda: detailed(not_evaluated=[0.0] * 3, change_by_10_mm_N=[5.0, 15.0, 20.0]),
    "study_two": lambda: table(
        "r_A_mm", "alpha_A[2]_deg",
        rows=[(r, h, 10 * r + h if h < 3 else NAN) for h in (3.0, 1.0, 2.0) for r in (2.0, 1.0)]),
    "study_many": lambda: table(
        "r_A_mm", "cuff_height_mm",
        rows=[(100.0 + 10 * a, 150.0 + 5 * b, 60.0 - a + b) for a in (0, 1) for b in range(8)]),
    "study_lost": lambda: table("cuff_height_mm", rows=[(100.0 + k, NAN) for k in range(3)]),
    "study_rows": lambda: table("r_A_mm", rows=[(1.0, 3.0), (1.0, NAN), (1.0, 5.0)], figure="peak_F_s_N"),
    "study_bars": lambda: StudyTable([{"rank": 1} | row for row in ROWS]).plot("can_hold"),
    "force_map": lambda: force_map(ep.load("four-cables"), internal_rotation=10.0, step=20.0),
    "force_map_default": lambda: force_map(prototype(), **FREE),
    "force_map_newton": lambda: force_map(weightless(), step=4.0, split="minimal", constraint_bounds=20.0, **FREE),
    "force_map_no_data": lambda: force_map(sprung(5.0), step=40.0),
    "force_map_serial": lambda: force_map(robot("serial-y-x-z")),
    "overview": lambda: plots.overview(prototype(), prototype().pose(-0.2, 10, 25)),
    "overview_standalone": overview,
    "determinant": lambda: plots.determinant_map(prototype(), step=5.0).figure,
    "determinant_right": lambda: determinant_map("prototype", "right"),
    "determinant_of_rest": lambda: determinant_map("scenario-one", "left"),
    "search": lambda: search(("index", "mean_shoulder_force")),
    "search_one": lambda: search(("index",)),
    "search_single": lambda: search(("index",), False),
    "ball": lambda: plots.rotation_ball(workspace(15.0)),
    "slices": lambda: plots.workspace_slices(workspace(15.0)),
    "slices_folded": lambda: plots.workspace_slices(folded_workspace()),
    "contact_bare_box": lambda: contact_box(None),
    "contact_box": lambda: contact_box("four-cables"),
    "contact_box_better": lambda: contact_box("four-cables", 20.0),
    "contact_box_unknown": lambda: contact_box("prototype"),
    "contact_lift": lambda: contact_lift(True),
    "contact_bare_lift": lambda: contact_lift(False),
    "drawing": lambda: drawing("left"),
    "drawing_right": lambda: drawing("right"),
    "postures": lambda: postures(worn(), (0, 10), (60, 40)),
    "postures_right": lambda: postures(worn("right"), (30, 20)),
    "postures_serial": lambda: postures(robot("serial-y-x-z"), (40, 20), (0, 110)),
    "postures_spring": lambda: postures(robot("spring-support"), (50, 0), (0, 70)),
    "postures_parallel": lambda: postures(robot("3rps-passive-ball"), (40, 20)),
    "postures_thick": lambda: postures(thick(), (40, 20)),
    "postures_nobody": lambda: postures(ep.load(URDF / "nesm.urdf"), (30, 0)),
    "muscle_map": lambda: plots.plot_force_map(muscle.muscle_model("best"), muscle.steady_states()),
    "muscle_map_short": lambda: plots.plot_force_map(muscle.muscle_model("best", 0.15)),
    "muscle_loop": loop,
    "tracking": lambda: driven("four-cables", "torn"),
    "tracking_muscles": lambda: driven("prototype"),
    "tracking_both": lambda: both().track(RAISED).plot(),
    "tracking_joints": lambda: driven(URDF / "serial-y-x-z.urdf"),
    "tasks": lambda: plots.task_status_figure({"mouth": [1, 1, 0, 1], "hair": [0, 1, 0, 0]}),
    "tasks_timed": lambda: plots.task_status_figure({"mouth": [1, 0, 1]}, {"mouth": [2.0, 3.0, 6.0]}),
    "elbows": elbows,
    "day": day,
}  # fmt: skip
#: Those that need the extra ``person``.
OF_PERSON = {name for name in FIGURES if name.startswith("contact")} | {"total_uncertainty"}
