"""The record of a report: each number of its pages is a field, in the unit of its name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from typing import ClassVar

from ..core.records import Record
from ..core.results import Result
from .content import as_text, verdict_words
from .pages import save as save_pages


@dataclass(frozen=True)
class Posture(Record):
    """What happens in one posture; NaN where it is not known.

    Attributes
    ----------
    name : str
        Of the posture.
    flexion_deg, abduction_deg, internal_rotation_deg : float
        Degrees.
    holds : str
        "yes", "no", "not known", or of a support without drives "supports".
    reason : str
        Why not, as a sentence; empty where it holds.
    joint_N, joint_without_N : float
        Contact force in the joint, with the device and without it.
    push_N, push_out_N, push_up_N, push_forward_N : float
        What arm and device press on the head without muscles (-F_s): its size, and its parts out of the socket, up and
        forward along the socket.
    left_to_wearer_Nm : float
        Moment that a support leaves to the wearer; 0 of a device that holds the arm.

    Examples
    --------
    >>> report = ep.load("urdf/spring-support.urdf").report(ep.Person(1.75, 75, "male"))
    >>> forward = report.postures[1]
    >>> forward.name, forward.holds, f"{forward.left_to_wearer_Nm:.1f} N m"
    ('arm forward, 60°', 'supports', '5.0 N m')
    """

    name: str
    flexion_deg: float
    abduction_deg: float
    internal_rotation_deg: float
    holds: str
    reason: str
    joint_N: float
    joint_without_N: float
    push_N: float
    push_out_N: float
    push_up_N: float
    push_forward_N: float
    left_to_wearer_Nm: float


@dataclass(frozen=True)
class Task(Record):
    """A published range of motion of daily tasks; NaN where it is not known.

    Attributes
    ----------
    name, source : str
        Of the range.
    poses : int
        On its grid.
    held_percent : float
        Share of them that the device holds; NaN of a support without drives.
    joint_N, joint_peak_N, joint_without_N : float
        Contact force in the joint over the held poses that the wearer can take: median, largest, and median without
        the device.
    relief_percent : float
        Median of what the device takes from the joint, pose by pose; the most that it can.
    push_N : float
        Median of what arm and device press on the head without muscles.

    Examples
    --------
    >>> report = ep.load("urdf/spring-support.urdf").report(ep.Person(1.75, 75, "male"))
    >>> [(task.name, f"at most {task.relief_percent:.0f} %") for task in report.tasks[1:2]]
    [('daily tasks (Buckley et al.)', 'at most 60 %')]
    """

    name: str
    source: str
    poses: int
    held_percent: float
    joint_N: float
    joint_peak_N: float
    joint_without_N: float
    relief_percent: float
    push_N: float


@dataclass(frozen=True)
class DriveNeed(Record):
    """What one limb or drive has to do over the daily range; NaN where it is not known.

    Attributes
    ----------
    name, kind, unit : str
        Of the drive, its actuator's family, and "N" or "N m".
    pull, push : float
        Largest effort each way, N or N m; a limb pulls where its force is a tension.
    limit_pull, limit_push : float
        Of the design, N or N m.
    share_percent : float
        Largest share of the limit in the same pose.
    speed : float
        Largest speed while the arm turns as fast as :attr:`DesignReport.arm_speed_deg_s` about its worst axis, m/s or
        rad/s.
    power_W : float
        Largest effort times speed in the same pose.
    used_from, used_to, stroke_from, stroke_to : float
        Range that occurs, and that of the design, m or rad.
    mass_kg : float
        Of the limb in the design.
    held_without_percent : float
        Share of the poses that are held with this drive without effort, of those that are held with it.
    missing_without_Nm : float
        Largest moment that is then missing.

    Examples
    --------
    >>> report = ep.load("four-cables").report(ep.Person(1.75, 75, "male"))
    >>> need = report.drives[0]
    >>> need.name, f"{need.pull:.0f} N of {need.limit_pull:.0f}", f"{need.speed:.2f} m/s"
    ('limb 1', '89 N of 400', '0.13 m/s')
    """

    name: str
    kind: str
    unit: str
    pull: float
    push: float
    limit_pull: float
    limit_push: float
    share_percent: float
    speed: float
    power_W: float
    used_from: float
    used_to: float
    stroke_from: float
    stroke_to: float
    mass_kg: float
    held_without_percent: float
    missing_without_Nm: float


@dataclass(frozen=True)
class PersonFit(Record):
    """The same design on another person.

    Attributes
    ----------
    name : str
        Who it is, with the source of the sizes.
    height_m, mass_kg : float
        Of the person.
    held_percent, inside_percent : float
        Share of the daily range that is held, and that meets all criteria of the workspace, clearance among them.

    Examples
    --------
    >>> report = ep.load("urdf/spring-support.urdf").report(ep.Person(1.75, 75, "male"))
    >>> [(fit.height_m, fit.mass_kg) for fit in report.fits]
    [(1.525, 51.0), (1.87, 111.0)]
    """

    name: str
    height_m: float
    mass_kg: float
    held_percent: float
    inside_percent: float


@dataclass(frozen=True)
class Hazard(Record):
    """A hazard, what was computed for it, and what was not.

    Attributes
    ----------
    name, computed, not_computed : str
        In words; ``computed`` is empty where nothing was.

    Examples
    --------
    >>> report = ep.load("urdf/spring-support.urdf").report(ep.Person(1.75, 75, "male"))
    >>> report.hazards[1].name, report.hazards[1].not_computed
    ('Stress of the joint', 'injured, subluxed or spastic shoulders; repetition')
    """

    name: str
    computed: str
    not_computed: str


@dataclass(frozen=True, eq=False)
class DesignReport(Result):
    """All that the pages of a report say, for one design on one person.

    Attributes
    ----------
    design, title, summary, side : str
        Of the design; ``summary`` says what it is made of.
    design_hash : str
        SHA-256 of all data of the design on its wearer.
    file, file_hash : str
        The design file and its SHA-256; empty where none was named.
    person : str
        Who wears it, in words; empty where nobody is known.
    height_m, mass_kg : float
        Of the person; NaN of nobody.
    has_muscles : bool
        Whether the wearer's own muscles were counted.
    arm_speed_deg_s : float
        Speed of the arm for which the drives' speed and power are given.
    postures : tuple of Posture
        Three postures.
    tasks : tuple of Task
        Published ranges of daily tasks.
    poses : int
        Of the grid over the daily range of motion.
    daily_range : str
        That range with its source, in words.
    held_percent : float
        Share of them that is held; NaN of a support without drives.
    inside_percent : float
        Share that meets all criteria of the workspace that the design's data allow.
    criteria_percent : mapping of str to float
        Share of the poses that meet each.
    drives : tuple of DriveNeed
        Limbs or drives; empty of a support.
    drives_over : str
        Over which poses they are: "held poses", or "poses that are not held" of a design that holds none.
    device_on_arm_kg, device_links_kg : float
        Mass of the device on the arm, and of its other moving links in the design; NaN where the design has none.
    weakest_rate, weakest_rate_unit
        Rate of the drives about the arm's worst axis, mm/° or °/°; 99 of 100 reached poses exceed it.
    twins_percent : float
        Share of the poses with a second pose that the drives cannot tell from the first; NaN where not looked for.
    clear_mm : float
        Least distance of the device to the wearer and between its own limbs over the held poses; NaN if not known.
    cuff_pull_N, cuff_pressure_kPa : float
        Largest over the held poses; NaN if not known.
    off_by_10_mm_N, off_on_cuff_N : float
        Change of the force on the head where the device's centre is 10 mm beside the shoulder's, worst direction,
        median of six poses; NaN of a device that cannot follow. On a soft cuff, of such a device alone: its own or one
        as measured on 21 persons.
    fits : tuple of PersonFit
        A small and a large person in the same device.
    assumed, not_checked : tuple of str
        In sentences.
    hazards : tuple of Hazard
        After the public headings of ISO 13482:2014.
    hazard_source : str
        Where their headings are from, and what the list is not.
    picture : bytes
        PNG of the three postures.

    Examples
    --------
    >>> report = ep.load("urdf/spring-support.urdf").report(ep.Person(1.75, 75, "male"))
    >>> report.poses, report.side, report.drives
    (125, 'left', ())
    """

    _hidden: ClassVar[frozenset[str]] = frozenset({"picture"})

    design: str
    title: str
    summary: str
    side: str
    design_hash: str
    file: str
    file_hash: str
    person: str
    height_m: float
    mass_kg: float
    has_muscles: bool
    arm_speed_deg_s: float
    postures: tuple[Posture, ...]
    tasks: tuple[Task, ...]
    poses: int
    daily_range: str
    held_percent: float
    inside_percent: float
    criteria_percent: Mapping[str, float]
    drives: tuple[DriveNeed, ...]
    drives_over: str
    device_on_arm_kg: float
    device_links_kg: float
    weakest_rate: float
    weakest_rate_unit: str
    twins_percent: float
    clear_mm: float
    cuff_pull_N: float
    cuff_pressure_kPa: float
    off_by_10_mm_N: float
    off_on_cuff_N: float
    fits: tuple[PersonFit, ...]
    assumed: tuple[str, ...]
    not_checked: tuple[str, ...]
    hazards: tuple[Hazard, ...]
    hazard_source: str
    picture: bytes

    @property
    def version(self) -> str:
        """Of the package."""
        return str(self.provenance["exo_pin"])

    @property
    def verdict(self) -> str:
        """What the device does over the daily range, in a sentence or two."""
        return verdict_words(self)

    def save(self, path: str | PathLike[str]) -> None:
        """Write the pages, whole or not at all.

        Parameters
        ----------
        path : path-like
            Where to: ``.pdf``, two A4 pages, or ``.html``, one page that needs no other file.

        Raises
        ------
        InvalidInput
            If it has another ending.
        MissingExtra
            If it is a PDF and the extra ``report`` is not installed.

        Examples
        --------
        >>> from pathlib import Path
        >>> report = ep.load("urdf/spring-support.urdf").report(ep.Person(1.75, 75, "male"))
        >>> report.save("spring-support.pdf")
        >>> Path("spring-support.pdf").read_bytes()[:5]
        b'%PDF-'
        """
        save_pages(self, path)

    def __str__(self) -> str:
        return as_text(self)
