"""``exo-pin person``: the wearer, and the force in the shoulder joint with their own muscles."""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np

from ...core.conventions import CLINICAL_ANGLES
from ...core.errors import InvalidInput
from ...core.tables import under_verdict
from ...exo.shoulder_exo import ShoulderExo, load
from ...load_case.ranges_of_motion import ADL_BOX
from ...person import ContactOptions, Person
from ...person.bare_arm import BARE_ARM_PERSON
from ...view.plots.contact_plots import contact_over_box, contact_over_elevation, elevation_in_plane
from .. import add_flag, add_moved, add_number, add_outputs, deliver, needs
from ..options.option_values import refuse
from ..options.query_options import (
    add_design,
    add_limits,
    add_movement,
    add_pose,
    limits,
    movement,
    pose,
    pose_words,
    wearer,
)


def add_commands(commands: Any) -> None:
    """Register the command."""
    parser = commands.add_parser("person")
    add_design(parser)
    add_pose(parser)
    parser.add_argument(
        "--person",
        default=",".join(map(str, BARE_ARM_PERSON)),
        metavar="HEIGHT,MASS,SEX",
        help="the wearer: height in m, mass in kg, male or female (default %(default)s)",
    )
    add_number(parser, "--strength", "PERCENT", "strength of all muscles, percent", 100.0)
    add_number(parser, "--elbow-flexion", "DEG", "bend of the elbow, 0 to 130 degrees", 0.0)
    add_number(parser, "--payload", "KG", "mass in the hand, kg", 0.0)
    add_flag(parser, "--bare", "without a device")
    add_number(
        parser,
        "--share",
        "PERCENT",
        "of the moments of the arm that the device carries (default 100; 0: it carries only itself)",
    )
    parser.add_argument(
        "--least",
        choices=("effort", "contact"),
        help="choose the limb forces for least muscle effort, or for least contact force (a lower bound)",
    )
    add_limits(parser)
    add_number(
        parser,
        "--side-force-limit",
        "N",
        "side forces of UPU limbs up to this size, chosen with the activations (default: none)",
    )
    add_flag(parser, "--moving-centre", "the device's centre stays where the shoulder's is at rest")
    add_flag(parser, "--cubes", "least sum of cubed instead of squared activations")
    add_flag(parser, "--volumes", "weigh the muscles by their volume")
    add_flag(parser, "--passive", "stretched muscles pull without activation")
    add_flag(parser, "--any-direction", "let the force leave the socket's rim")
    add_flag(parser, "--range", "change the assumptions one at a time")
    add_movement(parser)
    add_flag(parser, "--map", "over the box of daily activities instead of a pose")
    add_number(parser, "--step", "DEG", "step of the map's grid, degrees", 20.0)
    add_flag(parser, "--progress", "show a progress bar")
    shown = "contact force over the elevation in the plane of the pose, over the box of --map, or over time"
    add_outputs(parser, ".json", ".csv", ".npz", plot=shown)
    needs(parser, always="person")
    add_moved(parser, literature="in docs/person.md, beside published values")
    parser.set_defaults(run=_person)


def _person(options: argparse.Namespace) -> int:
    exo = load(options.design, side=options.side)
    person = wearer(options, strength=options.strength / 100.0, side=exo.side)
    ways = [name for name in ("map", "range", "trajectory") if getattr(options, name)]
    if len(ways) > 1:
        raise InvalidInput(f"--{' and --'.join(ways)} do not go together: give one of them")
    if ways:
        given = f"--{ways[0]}" if ways[0] != "range" else ""
        if given:
            refuse(options, f"{given} has poses of its own", "flexion", "abduction", "internal_rotation")
    subject, query = _question(exo, person, options)
    answer = _movement if options.trajectory else _map if options.map else _pose
    heading, result, more, figure = answer(exo, person, subject, query, options)
    deliver(
        options,
        f"{_device(exo, options)}\n{heading}\n\n{result}\n\nPerson\n{person}",
        json=result.to_json,
        columns=lambda: more | contact_columns(result),
        figure=figure,
    )
    return 0


def _pose(exo: ShoulderExo, person: Person, subject: Any, query: dict[str, Any], options: argparse.Namespace) -> Any:
    orientation = pose(options, exo)
    if options.range:
        refuse(options, "--range prints a table of assumptions", "out")
        return pose_words(options, exo), subject.contact_range(orientation, **query), {}, None

    def figure() -> Any:
        elevations, contact, azimuth = elevation_in_plane(subject, orientation, exo.side, **query)
        axes = contact_over_elevation(elevations, contact)
        return axes.set_title(f"{_name(exo, options)}: plane of elevation {azimuth:.0f}° from forward").figure

    return pose_words(options, exo), subject.joint_contact(orientation, **query), {}, figure


def _movement(
    exo: ShoulderExo, person: Person, subject: Any, query: dict[str, Any], options: argparse.Namespace
) -> Any:
    """Along a measured movement."""
    moved = movement(options, exo.side)
    poses = moved.poses if options.static else moved
    result = subject.joint_contact(poses, **query, outside="mark", progress=options.progress)
    heading = f"{exo.side} shoulder, {len(moved.times)} samples"
    if result.peak_row is not None:
        heading += f", the largest contact force at {moved.times[result.peak_row]:.3g} s"
    cautions = under_verdict("", moved.pose_cautions)
    heading = f"{heading}\n{cautions}".rstrip()
    figure = lambda: contact_over_elevation(moved.times, result, label="time, s").set_title(_name(exo, options)).figure  # noqa: E731
    return heading, result, {"time_s": moved.times}, figure


def _map(exo: ShoulderExo, person: Person, subject: Any, query: dict[str, Any], options: argparse.Namespace) -> Any:
    """Over the box of daily activities, as far as the person's range of motion goes."""
    poses = ADL_BOX.poses(options.step, exo.side)
    result = subject.joint_contact(poses, **query, outside="mark", progress=options.progress)

    def figure() -> Any:
        drawn = contact_over_box(ADL_BOX.axes(options.step), result)
        drawn.suptitle(_name(exo, options))
        return drawn

    angles = np.meshgrid(*ADL_BOX.axes(options.step), indexing="ij")
    heading = f"{exo.side} shoulder over the {ADL_BOX.name}, {options.step:g}° grid"
    return heading, result, dict(zip(CLINICAL_ANGLES, angles, strict=True)), figure


def contact_columns(result: Any) -> dict[str, Any]:
    """Columns of an answer, with the contact force without the device."""
    bare = result.without_device
    return result.columns() | ({} if bare is None else {"magnitude_without_device": bare.magnitude})


def _assumptions(options: argparse.Namespace) -> ContactOptions:
    return ContactOptions(
        power=3 if options.cubes else 2,
        weights="volume" if options.volumes else "equal",
        passive=options.passive,
        cone=None if options.any_direction else ContactOptions().cone,
    )


def _question(exo: ShoulderExo, person: Person, options: argparse.Namespace) -> tuple[Any, dict[str, Any]]:
    """The bare person or the design, whichever the options mean, and the arguments besides the poses."""
    query: dict[str, Any] = {"options": _assumptions(options)}
    bounds, sides = limits(options), options.side_force_limit
    if options.bare:
        given = (options.share, options.least, None if bounds == "design" else bounds)
        if options.moving_centre or sides or any(value is not None for value in given):
            raise InvalidInput(
                "--bare is without a device: leave out --share, --least, --limits, --side-force-limit, --moving-centre"
            )
        return person, query
    if options.share is not None and options.least is not None:
        raise InvalidInput("--share gives the limb forces and --least chooses them: give one of the two")
    query["limits"] = bounds
    if options.least is not None:
        query["forces"] = f"least_{options.least}"
    else:
        query["forces"] = (100.0 if options.share is None else options.share) / 100.0
    offset = person.centre_path() if options.moving_centre else None
    return exo, query | {"person": person, "centre_offset": offset, "constraint_bounds": sides}


def _device(exo: ShoulderExo, options: argparse.Namespace) -> str:
    return "No device" if options.bare else exo.mechanism.title or exo.name


def _name(exo: ShoulderExo, options: argparse.Namespace) -> str:
    return "No device" if options.bare else exo.name
