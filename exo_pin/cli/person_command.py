"""``exo-pin person``: the wearer, and the force in the shoulder joint with their own muscles."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

import numpy as np

from ..core.conventions import CLINICAL_ANGLES, pose_columns
from ..core.errors import InvalidInput
from ..core.optional_packages import require_extra
from ..core.tables import under_verdict
from ..design import DEFAULT_PRESET
from ..exo.loading import load
from ..exo.shoulder_exo import ShoulderExo
from ..load_case.ranges_of_motion import ADL_BOX
from ..view.plots.contact_plots import contact_over_box, contact_over_elevation, elevation_in_plane
from ..view.plots.plot_style import figure_title
from . import options
from .command import Files, writes
from .options.recording_options import RecordedMotion


@writes(
    ".json",
    ".csv",
    ".xlsx",
    ".npz",
    plot="contact force over the elevation in the plane of the pose, over the box of --map, or over time",
)
def person(
    design: options.Design = DEFAULT_PRESET,
    /,
    *,
    side: options.Side = None,
    pose: options.Pose = options.Pose(),
    recording: RecordedMotion = RecordedMotion(),
    map: bool = False,
    step: options.Degrees = 20.0,
    range: bool = False,
    worn: options.Someone = options.Someone(),
    strength: options.Percent = 100.0,
    bare: bool = False,
    share: options.Share | None = None,
    least: Literal["effort", "contact"] | None = None,
    limits: options.LimitsText = "design",
    side_force_limit: options.Newtons | None = None,
    moving_centre: bool = False,
    progress: options.Progress = False,
    files: Files = Files(),
) -> None:
    """Compute the contact force in the shoulder joint with the wearer's own muscles, with the device and without it.

    In a pose, along a measured movement or over the box of daily activities.

    Parameters
    ----------
    map : bool
        Over the box of daily activities instead of a pose.
    step : float
        Step of the map's grid, degrees.
    range : bool
        Change the assumptions one at a time.
    strength : float
        Strength of all muscles, percent.
    bare : bool
        Without a device.
    share : float, optional
        Share of the arm's moments that the device carries, percent (default 100; 0: the device carries only itself; not
        of a device without drives, whose springs carry what they do).
    least : str, optional
        Choose the limb forces for least muscle effort, or for least contact force (a lower bound).
    side_force_limit : float, optional
        Greatest side force of a UPU limb, N; side forces are then chosen with the activations (default: no side
        forces).
    moving_centre : bool
        The device's centre stays where the shoulder's is at rest.

    Examples
    --------
    exo-pin person four-cables --flexion 60
    exo-pin person four-cables --trajectory examples/lift.csv --out contact.csv
    exo-pin person --bare --abduction 90 --range
    """
    require_extra("person")
    exo = load(design, side=side)
    wearer = worn.muscles(strength=strength / 100.0, side=exo.side)
    ways = [f"--{name}" for name, given in (("map", map), ("range", range), ("trajectory", recording)) if given]
    if len(ways) > 1:
        raise InvalidInput(f"{' and '.join(ways)} do not go together: give one of them")
    if map or recording:
        options.refuse(f"{ways[0]} has poses of its own", **options.given(pose))
    query: dict[str, Any] = {}
    bounds = options.limits_of(limits)
    if bare:
        given = (share, least, None if bounds == "design" else bounds)
        if moving_centre or side_force_limit or any(value is not None for value in given):
            raise InvalidInput(
                "--bare is without a device: leave out --share, --least, --limits, --side-force-limit, --moving-centre"
            )
    else:
        query = {"person": wearer, "limits": bounds, "constraint_bounds": side_force_limit}
        query |= {"forces": _forces(share, least), "centre_offset": wearer.centre_path() if moving_centre else None}
    asked = _Asked(exo, wearer if bare else exo, query, progress)
    if recording:
        heading, result, more, figure = asked.along(recording)
    elif map:
        heading, result, more, figure = asked.over_box(step)
    else:
        orientation, heading = pose.of(exo), pose.words(exo)
        more = dict(zip(CLINICAL_ANGLES, pose.angles, strict=True))
        if range:
            options.refuse("--range prints a table of assumptions", out=files.out)
            result, figure = asked.subject.contact_range(orientation, **query), None
        else:
            result, figure = asked.subject.joint_contact(orientation, **query), lambda: asked.raised(orientation)

    def titled() -> Any:
        drawn, said = figure()
        size = f"{wearer.sex}, {wearer.height:.4g} m, {wearer.mass:.4g} kg, {exo.side} shoulder"
        figure_title(drawn, "No device" if bare else exo.name, f"{size}; {said}")
        return drawn

    files.deliver(
        f"{'No device' if bare else exo.device.title or exo.name}\n{heading}\n\n{result}\n\nPerson\n{wearer}",
        result,
        exo=None if bare else exo,
        columns=lambda: more | result.columns(),
        figure=titled if figure else None,
    )


class _Asked(NamedTuple):
    """A device, or a person without one, and the arguments of the question besides the poses."""

    exo: ShoulderExo
    subject: Any
    query: dict[str, Any]
    progress: bool

    def along(self, recording: RecordedMotion) -> Any:
        """Along a measured movement: heading, answer, more columns, and what draws a figure and says what it shows."""
        moved = recording.movement(self.exo.side)
        poses = moved.poses if recording.static else moved
        result = self.subject.joint_contact(poses, **self.query, outside="mark", progress=self.progress)
        heading = f"{self.exo.side} shoulder, {len(moved.times)} samples"
        if result.peak_row is not None:
            heading += f", the largest contact force at {moved.times[result.peak_row]:.3g} s"
        heading = f"{heading}\n{under_verdict('', moved.pose_cautions)}".rstrip()
        return (
            heading,
            result,
            {"time_s": moved.times} | pose_columns(moved.poses, self.exo.side),
            lambda: (contact_over_elevation(moved.times, result, label="time, s").figure, "measured movement"),
        )

    def over_box(self, step: float) -> Any:
        """Over the box of daily activities, as far as the person's range of motion goes; returns as :meth:`along`."""
        axes, poses = ADL_BOX.axes(step), ADL_BOX.poses(step, self.exo.side)
        result = self.subject.joint_contact(poses, **self.query, outside="mark", progress=self.progress)
        return (
            f"{self.exo.side} shoulder over the {ADL_BOX.name}, {step:g}° grid",
            result,
            dict(zip(CLINICAL_ANGLES, np.meshgrid(*axes, indexing="ij"), strict=True)),
            lambda: (contact_over_box(axes, result), "contact force, median over internal rotation"),
        )

    def raised(self, orientation: Any) -> Any:
        """The figure over the elevation in the plane of a pose, and what it shows."""
        elevations, contact, azimuth = elevation_in_plane(self.subject, orientation, self.exo.side, **self.query)
        plane = {0: "forwards", 90: "sideways"}.get(round(azimuth), f"in the plane {azimuth:.0f}° from forward")
        return contact_over_elevation(elevations, contact).figure, f"arm raised {plane}"


def _forces(share: float | None, least: str | None) -> str | float | None:
    """What chooses the limb forces."""
    if share is not None and least is not None:
        raise InvalidInput("--share gives the limb forces and --least chooses them: give one of the two")
    if least is not None:
        return f"least_{least}"
    return None if share is None else share / 100.0
