"""Answers of what drives of a design must do and weigh, and of where searches begin, as stored."""

from dataclasses import replace

import numpy as np
from answers import changes, each_of
from asked_in_turn import refused
from places import URDF

import exo_pin as ep
from exo_pin.workspace import free_joints, lifting_poses, starting_design, workspace
from exo_pin.workspace.optimisation import lifting_lines
from exo_pin.workspace.parts import PRODUCTS, parts_list, parts_sheet, with_drive_masses


def load(name):
    return ep.load(URDF / f"{name}.urdf" if (URDF / f"{name}.urdf").exists() else name)


def few(exo):
    """Poses without a symmetry."""
    return exo.pose([20.0, 75.0, 40.0, 5.0], [35.0, 10.0, 70.0, 20.0], [-10.0, 25.0, 5.0, -60.0])


def parts():
    """What drives must do and which products do it: weak, strong, slow and fast ones, of limbs, drums and hinges."""
    linear, cables, serial = load("four-linear-actuators-worn"), load("four-cables"), load("serial-y-x-z")
    found = []
    for exo, factor, rate, mass in (
        (linear, 1.0, 0.6, 0.4),
        (linear, 12.0, 0.02, None),
        (linear, 0.2, 0.35, None),
        (cables, 1.0, 2.0, 0.9),
        (cables, 4.0, 0.1, None),
        (serial, 1.0, 0.5, None),
        (serial, 1.9, 0.9, 1.1),
        (load("four-muscle-cables"), 1.0, 0.5, 0.2),
    ):
        arm = ep.Arm(3.7 * factor, [0.01, 0.0, -0.25])
        worn = exo.replace(arm=arm)
        at = workspace(worn.device, few(exo), ["singularity"])
        at = replace(at, tensions=worn.reaction(few(exo), split="minimal", limits="none").actuator_forces)
        table = parts_list(worn.device, at, rate, mass)
        found.append(
            (table["order"], table["mass_kg"], table["speed"], table["power_W"], parts_sheet(worn.device, table))
        )
    return [PRODUCTS, found]


def heavy():
    """Drives that have mass: one left as it is, of a linear actuator and of a muscle."""
    linear, muscles = load("four-linear-actuators-worn"), load("four-muscle-cables")
    return [
        [(limb.base_body, limb.platform_body) for limb in with_drive_masses(exo.mechanism, masses).limbs]
        for exo, masses in ((linear, [0.3, np.nan, 0.5, 0.7]), (muscles, [0.2, 0.3, np.nan, 0.1]))
    ]


def stated():
    """Drives whose mass the design states, and where the moving part of a searched device comes from."""
    exo = load("four-linear-actuators-worn")
    worn = exo.replace(limbs=with_drive_masses(exo.mechanism, [0.3, 0.4, 0.5, 0.6]).limbs)
    at = workspace(worn.device, few(exo), ["forces"])
    table = parts_list(worn.device, at, 0.5)
    cable = ep.Actuator("cable", pull_limit=90.0)
    made = starting_design(cable, ep.Arm.from_anthropometry(1.7, 66, sex="female"), device=exo.mechanism)
    return [table["order"], table["mass_kg"], parts_sheet(worn.device, table), made.arm.mass, made.side], refused(
        lambda: starting_design(cable, None, 4, device=exo.mechanism.replace(arm=None)),
        lambda: starting_design(cable, None, 4, device=load("four-cables").mechanism),
    )


def starts():
    """Where searches begin."""
    arm = ep.Arm.from_anthropometry(1.7, 66, sex="female")
    motor, cable = ep.Actuator("linear", pull_limit=500.0, push_limit=200.0), ep.Actuator("cable", pull_limit=90.0)
    poses = lifting_poses("right", counts=(3, 2, 2))
    sketches = (
        starting_design(motor, arm),
        starting_design([cable, cable, motor], arm, side="right", name="mine", device=load("four-cables").mechanism),
    )
    return [
        *[(each.geometry.base_points, each.geometry.platform_points, each.arm.mass, each.side, each.name,
           [(limb.kind, limb.actuator) for limb in each.limbs]) for each in sketches],
        free_joints(2, (0.1, 0.2), (0.05, 0.1), (0.11, 0.22)), free_joints(1),
        poses, lifting_poses().poses.shape, [lines.as_rotvec() for lines in lifting_lines("right", 40.0)],
    ]  # fmt: skip


def refused_parts():
    exo = load("four-linear-actuators-worn")
    held = exo.workspace(few(exo), ["forces"])
    return refused(
        lambda: parts_list(exo.device, held, -1.0),
        lambda: parts_list(exo.device, held, drive_mass=0.0),
        lambda: with_drive_masses(exo.mechanism, [0.3, 0.3, 0.3]),
        lambda: with_drive_masses(exo.mechanism, [0.3, 0.3, 0.0, 0.1]),
        lambda: with_drive_masses(load("appendix-d").mechanism, [0.3] * 3),
        lambda: lifting_lines("left", 0.0),
    )  # fmt: skip


ASKED = {each.__name__: each for each in (parts, heavy, stated, starts, refused_parts)}


@each_of(ASKED)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
