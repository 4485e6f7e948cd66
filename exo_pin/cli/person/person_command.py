"""``exo-pin person``: the wearer, and the force in the shoulder joint with their own muscles."""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np

from ...core.conventions import CLINICAL_ANGLES
from ...core.errors import InvalidInput
from ...core.tables import under_verdict
from ...exo.loading import load
from ...exo.shoulder_exo import ShoulderExo
from ...load_case.ranges_of_motion import ADL_BOX
from ...person import ContactOptions, Person
from ...view.plots.contact_plots import contact_over_box, contact_over_elevation, elevation_in_plane
from ...view.plots.plot_style import figure_title
from .. import deliver
from ..options.query_options import limits, movement, pose, pose_words, refuse, wearer


def run_person(options: argparse.Namespace) -> int:
    """Answer ``exo-pin person`` and return its exit status."""
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
        f"{'No device' if options.bare else exo.device.title or exo.name}\n{heading}\n\n{result}\n\nPerson\n{person}",
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
        figure_title(axes.figure, _name(exo, options), f"{_wearer_words(person, exo)}; arm raised {_plane(azimuth)}")
        return axes.figure

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

    def figure() -> Any:
        axes = contact_over_elevation(moved.times, result, label="time, s")
        figure_title(axes.figure, _name(exo, options), f"{_wearer_words(person, exo)}; measured movement")
        return axes.figure

    return heading, result, {"time_s": moved.times}, figure


def _map(exo: ShoulderExo, person: Person, subject: Any, query: dict[str, Any], options: argparse.Namespace) -> Any:
    """Over the box of daily activities, as far as the person's range of motion goes."""
    poses = ADL_BOX.poses(options.step, exo.side)
    result = subject.joint_contact(poses, **query, outside="mark", progress=options.progress)

    def figure() -> Any:
        drawn = contact_over_box(ADL_BOX.axes(options.step), result)
        words = f"{_wearer_words(person, exo)}; contact force, median over internal rotation"
        figure_title(drawn, _name(exo, options), words)
        return drawn

    angles = np.meshgrid(*ADL_BOX.axes(options.step), indexing="ij")
    heading = f"{exo.side} shoulder over the {ADL_BOX.name}, {options.step:g}° grid"
    return heading, result, dict(zip(CLINICAL_ANGLES, angles, strict=True)), figure


def _wearer_words(person: Person, exo: ShoulderExo) -> str:
    return f"{person.sex}, {person.height:.4g} m, {person.mass:.4g} kg, {exo.side} shoulder"


def _plane(azimuth: float) -> str:
    """The plane in which an arm is raised, in words."""
    return {0: "forwards", 90: "sideways"}.get(round(azimuth), f"in the plane {azimuth:.0f}° from forward")


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
    elif options.share is not None:
        query["forces"] = options.share / 100.0
    offset = person.centre_path() if options.moving_centre else None
    return exo, query | {"person": person, "centre_offset": offset, "constraint_bounds": sides}


def _name(exo: ShoulderExo, options: argparse.Namespace) -> str:
    return "No device" if options.bare else exo.name
