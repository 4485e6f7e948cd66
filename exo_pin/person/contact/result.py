"""The contact force of the glenohumeral joint, with the muscles that cause it.

A person's build and contact forces as short tables for reading.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ...core.conventions import MIRROR, WRENCH_MIRROR
from ...core.results import Result
from ...core.tables import aligned, effort_column, filled
from ...core.validation import FloatArray, ReadOnly
from ..limb.muscle_table import MUSCLES

if TYPE_CHECKING:
    from ..wearer import Person

#: Muscles that are named together.
_GROUPS = {
    "deltoid": ("DELT1", "DELT2", "DELT3"),
    "rotator cuff": ("SUPSP", "INFSP", "SUBSC", "TMIN"),
    "pectoralis major": ("PECM1", "PECM2", "PECM3"),
    "latissimus and teres major": ("LAT1", "LAT2", "LAT3", "TMAJ"),
    "biceps and coracobrachialis": ("BIClong", "BICshort", "CORB"),
    "triceps": ("TRIlong", "TRIlat", "TRImed"),
}
#: How many muscles are listed, and the least activation of a listed one.
_LISTED, _LEAST = 8, 0.01
#: Lines of every table, and the sizes of a contact that they show.
_SIZES = {
    "contact force, N": "magnitude",
    "  % of body weight": "percent_body_weight",
    "  compression, N": "compression",
    "  shear, N": "shear",
}


def contact_table(contact: JointContact) -> str:
    """Lay out a result: the verdict, forces, muscles and assumptions; for a stack, peaks.

    Parameters
    ----------
    contact : JointContact
        The result; with a device also the one without it.

    Returns
    -------
    str
    """
    columns = [("", contact)] if contact.without_device is None else [
        ("with device", contact),
        ("without", contact.without_device),
    ]  # fmt: skip
    rows = _pose_rows(columns) if contact.status.ndim == 0 else _stack_rows(columns)
    header = [["", *(name for name, _ in columns)]] if len(columns) > 1 else []
    notes = [f"{name}: {text}" for name, text in contact.assumptions.items()]
    return "\n".join([filled(contact.verdict), "", *aligned(header + rows, words=1), "", "Assumptions", *notes])


def _number(value: float, digits: int = 0) -> str:
    if not np.isfinite(value):
        return "-"
    return f"{0.0 if abs(value) < 0.5 * 10.0**-digits else value:.{digits}f}"


def _pose_rows(columns: list[tuple[str, JointContact]]) -> list[list[str]]:
    results = [contact for _, contact in columns]
    rows = [["status", *(str(r.status) for r in results)]]
    for label, name in _SIZES.items():
        rows.append([label, *(_number(float(getattr(r, name))) for r in results)])
    if any(str(r.status) in ("too_weak", "unstable") for r in results):
        rows.append(["missing moment, N m", *(_number(float(np.linalg.norm(r.missing_moment)), 1) for r in results)])
        rows.append(["  at elbow and forearm", *(_number(float(np.abs(r.missing_elbow).sum()), 1) for r in results)])
    for kind, forces in (("force", results[0].device_forces), ("side force", results[0].constraint_forces)):
        names = [f"{name}, {unit}" for name, unit in results[0].drive_units]
        names = names or [f"limb {limb} {kind}, N" for limb in range(1, 1 + len(forces))]
        rows += [
            [name, _number(float(force), 1 if name.endswith("N m") else 0), "-"]
            for name, force in zip(names[: len(forces)], forces, strict=True)
            if not name.startswith("wearer about ")
        ]
    strongest = np.nan_to_num(np.max([r.activations for r in results], axis=0))
    order = [k for k in np.argsort(-strongest, kind="stable")[:_LISTED] if strongest[k] >= _LEAST]
    for k in order:
        cells = [f"{_number(100.0 * float(r.activations[k]))} %" for r in results]
        rows.append([f"activation {results[0].muscles[k]}", *cells])
    return rows


def _stack_rows(columns: list[tuple[str, JointContact]]) -> list[list[str]]:
    results = [contact for _, contact in columns]
    rows = [["poses", *(str(r.status.size) for r in results)]]
    found = dict.fromkeys(np.concatenate([np.unique(r.status) for r in results]).tolist())
    rows += [[f"  {status}", *(str(int((r.status == status).sum())) for r in results)] for status in found]
    for label, name in _SIZES.items():
        for word, of in (("median", np.nanmedian), ("peak", np.nanmax)):
            cells = []
            for r in results:
                values = getattr(r, name)[r.has_result]
                cells.append(_number(float(of(values))) if values.size else "-")
            rows.append([f"{label}, {word}", *cells])
    relief = results[0].relief_percent
    if relief is not None and np.isfinite(relief).any():
        low, middle, high = np.nanpercentile(relief, [25.0, 50.0, 75.0])
        rows.append(["relief, %, median", _number(float(middle)), ""])
        rows.append(["  quartiles", f"{_number(float(low))} to {_number(float(high))}", ""])
        rows.append(
            ["  poses with less force, %", _number(100.0 * float((relief[np.isfinite(relief)] > 0.0).mean())), ""]
        )
    return rows


def build_table(person: Person) -> str:
    """Lengths, masses and strengths of a person.

    Parameters
    ----------
    person : Person
        Whose.

    Returns
    -------
    str
        Strengths are sums of the peak isometric forces of a group, N.
    """
    arm, forces = person.arm, person.muscle_table.force
    place, elbow = 1e3 * float(np.linalg.norm(arm.centre_of_mass)), np.degrees(person.elbow_flexion)
    load = f" with {person.payload:g} kg in the hand" if person.payload else ""
    strengths = [
        f"{name} {sum(forces[MUSCLES.index(muscle)] for muscle in group):.0f}" for name, group in _GROUPS.items()
    ]
    return (
        f"{person.height:g} m, {person.mass:g} kg, {person.sex}, {person.side} arm, elbow at {elbow:.0f}°\n"
        f"upper arm {-1e3 * person.elbow_centre[2]:.0f} mm; arm {arm.mass:.2f} kg{load}, its centre of mass "
        f"{place:.0f} mm from the shoulder\n"
        f"strength, N: {', '.join(strengths[:3])},\n  {', '.join(strengths[3:])}"
    )


#: What holds the joint of a wearer whose muscles have no force.
WITHOUT_MUSCLES = "capsule and ligaments alone hold the head; how much they bear is not known"

#: Why a pose has no result.
NO_RESULT = {
    "too_weak": "The muscles are too weak to hold the arm in this pose.",
    "unstable": "The muscles can hold the arm only with a contact force outside the socket's rim.",
    "outside": "The pose is outside the range of motion.",
    "no_device_force": "The device has no limb forces in this pose.",
    "not_solved": "The solver found no result.",
}
#: What can become of a pose. Only "ok" has a result.
STATUS = ("ok", *NO_RESULT)


@dataclass(frozen=True, eq=False)
class JointContact(Result, ReadOnly):
    """Contact force and muscles in a pose or a stack of poses of shape (...), m muscles and n limbs.

    Vectors are in {O_A}. Rows without a result are NaN; ``status`` says why.

    Attributes
    ----------
    force : ndarray
        Shape (..., 3), N: force of the scapula **on the humerus**, at the glenohumeral centre.
    activations : ndarray
        Shape (..., m), 0 to 1, in the order of :attr:`muscles`.
    muscle_forces : ndarray
        Tensions, active and passive, shape (..., m), N.
    device_forces : ndarray
        Limb forces of the device, tension positive, shape (..., n), N; of a device that is not a wrist the efforts of
        its drives, whose names and units are ``drive_units``.
    constraint_forces : ndarray
        Side forces g of the limbs that were chosen with the activations, shape (..., n), N; shape (..., 0) where limbs
        carry none, or where they are part of a Reaction.
    device_wrench : ndarray
        Force, N, and moment about the glenohumeral centre, N m, of the device on the arm, shape (..., 6).
    glenoid : ndarray
        Axes of the socket, shape (..., 3, 3), rows: out of the socket, superior, anterior.
    centre : ndarray
        Displacement of the glenohumeral centre from its place at rest, shape (..., 3), m.
    status : ndarray of str
        Shape (...): "ok"; "too_weak" (the muscles cannot balance the arm); "unstable" (they can, but only with a
        contact force outside the socket's rim); "outside" (beyond the range of motion); "no_device_force" (the given
        limb forces have no value here); "not_solved".
    missing_moment : ndarray
        Shape (..., 3), N m: moment about the glenohumeral centre that would have to be added for a pose that is too
        weak or unstable. Zero where the pose is held, NaN where no moment would do.
    missing_elbow : ndarray
        Shape (..., 2), N m: the same for elbow flexion and pronation; of a wearer of strength 0 also in poses that the
        device holds, whose elbow something else has to hold.
    residual : ndarray
        Shape (...): what the moment balance of the arm misses, relative to the sum of its terms, or to a
        millionth of a newton metre where these are less.
    kkt, gap : ndarray
        Shape (...): violation of the optimality conditions and duality gap of the scaled program.
    body_weight : float
        N, under standard gravity.
    side : {"left", "right"}
        Side of the body.
    assumptions : dict of str to str
        What the result rests on.
    without_device : JointContact or None
        The same for the arm alone; None where there is no device.
    caution : str
        What the device cannot do, as a sentence; empty if it can, or if that is not known.
    record_cautions : tuple of str
        Doubts about the measured movement that was asked about.
    held : ndarray of bool or None
        Shape (...): whether the device can do by itself what it was asked, as far as its limits are known; None without
        a device.
    drive_units : tuple of (str, str)
        Name and unit of each device force; empty for limbs.

    Examples
    --------
    >>> man = ep.Person(1.75, 75, "male")
    >>> answer = man.joint_contact(ep.shoulder_rotation(0, [30, 60, 90], 0, degrees=True))
    >>> answer.percent_body_weight.round()  # of 735 N; instrumented joints at 90°: 36 to 128
    array([35., 66., 59.])
    """

    _hidden: ClassVar[frozenset[str]] = frozenset({"caution", "held", "record_cautions", "drive_units"})

    force: FloatArray
    activations: FloatArray
    muscle_forces: FloatArray
    device_forces: FloatArray
    constraint_forces: FloatArray
    device_wrench: FloatArray
    glenoid: FloatArray
    centre: FloatArray
    status: NDArray[np.str_]
    missing_moment: FloatArray
    missing_elbow: FloatArray
    residual: FloatArray
    kkt: FloatArray
    gap: FloatArray
    body_weight: float
    side: str
    assumptions: dict[str, str]
    without_device: JointContact | None = None
    caution: str = ""
    held: NDArray[np.bool_] | None = None
    record_cautions: tuple[str, ...] = ()
    drive_units: tuple[tuple[str, str], ...] = ()

    def mirrored(self) -> JointContact:
        """Mirror image in the x-z plane, of the other side of the body.

        Moments are pseudovectors, and so are the axes X_i of the side forces: g changes its sign, as in
        :meth:`exo_pin.ShoulderExo.mirrored`.

        Returns
        -------
        JointContact

        Examples
        --------
        >>> man = ep.Person(1.75, 75, "male")
        >>> answer = man.joint_contact(ep.shoulder_rotation(20, 40, 0, degrees=True))
        >>> (answer.mirrored().force / answer.force).round(9), answer.mirrored().side
        (array([ 1., -1.,  1.]), 'right')
        """
        return replace(
            self,
            force=self.force @ MIRROR,
            constraint_forces=0.0 - self.constraint_forces,
            device_wrench=self.device_wrench @ WRENCH_MIRROR,
            glenoid=self.glenoid @ MIRROR,
            centre=self.centre @ MIRROR,
            missing_moment=-self.missing_moment @ MIRROR,
            side="left" if self.side == "right" else "right",
            without_device=None if self.without_device is None else self.without_device.mirrored(),
        )

    @property
    def muscles(self) -> tuple[str, ...]:
        """Names of the muscles."""
        return MUSCLES

    @property
    def magnitude(self) -> FloatArray:
        """Size of the contact force, shape (...), N."""
        return np.asarray(np.linalg.norm(self.force, axis=-1))

    @property
    def percent_body_weight(self) -> FloatArray:
        """Size of the contact force in percent of the person's weight, shape (...)."""
        return 100.0 * self.magnitude / self.body_weight

    @property
    def components(self) -> FloatArray:
        """Compression, superior and anterior shear on the humerus, shape (..., 3), N."""
        return np.asarray(np.einsum("...ij,...j->...i", self.glenoid, self.force))

    @property
    def compression(self) -> FloatArray:
        """Force that presses the joint surfaces together, shape (...), N."""
        return self.components[..., 0]

    @property
    def shear(self) -> FloatArray:
        """Size of the shear force, shape (...), N."""
        return np.asarray(np.hypot(self.components[..., 1], self.components[..., 2]))

    @property
    def effort(self) -> FloatArray:
        """Sum of the squared activations, shape (...)."""
        return np.asarray((self.activations**2).sum(axis=-1))

    @property
    def relief_percent(self) -> FloatArray | None:
        """By how much the device lowers the contact force, percent, shape (...); negative where it raises it.

        NaN where the device cannot hold what it was asked to: what the wearer's muscles then do is no effect of it.
        """
        bare = self.without_device
        if bare is None:
            return None
        relief = 100.0 * (1.0 - self.magnitude / bare.magnitude)
        return relief if self.held is None else np.where(self.held, relief, np.nan)

    @property
    def has_result(self) -> NDArray[np.bool_]:
        """Shape (...): whether the pose has a result."""
        return np.asarray(self.status == "ok")

    @property
    def has_muscles(self) -> bool:
        """Whether the wearer's muscles have any force."""
        return not self.assumptions.get("muscles", "").startswith("none")

    @property
    def verdict(self) -> str:
        """One sentence, behind what the device cannot do."""
        alone = "" if self.has_muscles else f"No muscle acts: {WITHOUT_MUSCLES}."
        return " ".join(text for text in (self.caution, alone, self._result()) if text)

    def _result(self) -> str:
        if self.status.ndim:
            good = int(self.has_result.sum())
            if not good:
                return "No pose has a result."
            peak = float(np.nanmax(self.percent_body_weight))
            held = f"{good} of {self.status.size} poses have a result"
            return f"{held}; the largest contact force is {peak:.0f} % of body weight."
        if str(self.status) in NO_RESULT:
            return NO_RESULT[str(self.status)]
        text = (
            f"The joint carries {float(self.magnitude):.0f} N, {float(self.percent_body_weight):.0f} % of body weight"
        )
        if self.relief_percent is None:
            return text + "."
        relief = float(self.relief_percent)
        if not np.isfinite(relief):
            return text + " with the device."
        if relief < 0:
            return f"{text}, {-relief:.0f} % more than without the device."
        return f"{text}, at most {relief:.0f} % less than without the device: people keep more tension."

    @property
    def peak_row(self) -> int | None:
        """Number of the pose with the largest contact force, in a flat stack; None where no pose has a result."""
        return int(np.nanargmax(self.magnitude)) if self.has_result.any() else None

    def summary(self) -> dict[str, float]:
        """Largest and mean contact force over the poses that have a result, with units in the keys; else NaN.

        Returns
        -------
        dict of str to float

        Examples
        --------
        >>> woman = ep.Person(1.63, 67, "female")
        >>> answer = woman.joint_contact(ep.shoulder_rotation([20, 50, 80], 0, 0, degrees=True))
        >>> round(answer.summary()["peak_contact_N"] - float(answer.magnitude.max()), 9)
        0.0
        """
        bare = self.without_device
        found = {"contact": self.magnitude} | ({} if bare is None else {"contact_without_device": bare.magnitude})
        numbers = {}
        for name, force in found.items():
            known = force[np.isfinite(force)]
            numbers[f"peak_{name}_N"] = float(known.max()) if known.size else float("nan")
            numbers[f"mean_{name}_N"] = float(known.mean()) if known.size else float("nan")
        return numbers

    _derived = ("magnitude", "percent_body_weight", "compression", "shear", "muscles", "relief_percent")

    @property
    def cautions(self) -> tuple[str, ...]:
        """What to mind about the device's part, and about the record of a movement."""
        return (*((self.caution,) if self.caution else ()), *self.record_cautions)

    def columns(self) -> dict[str, Any]:
        """Contact force, muscles by name, efforts of the device and reason, with units in the names.

        Returns
        -------
        dict of str to ndarray
            Each of the stack's shape; activations are shares of 1.

        Examples
        --------
        >>> man = ep.Person(1.75, 75, "male")
        >>> table = man.joint_contact(ep.shoulder_rotation([30, 60], 0, 0, degrees=True)).columns()
        >>> list(table)[3:5], table["status"].tolist()
        (['contact_N', 'contact_percent_body_weight'], ['ok', 'ok'])
        """
        found = {f"contact_{axis}_N": self.force[..., k] for k, axis in enumerate("xyz")}
        found |= {"contact_N": self.magnitude, "contact_percent_body_weight": self.percent_body_weight}
        if self.without_device is not None:
            found["contact_without_device_N"] = self.without_device.magnitude
        for k, name in enumerate(self.muscles):
            found |= {f"activation_{name}": self.activations[..., k], f"{name}_N": self.muscle_forces[..., k]}
        count = self.device_forces.shape[-1]
        units = self.drive_units or tuple((f"limb {i + 1}", "N") for i in range(count))
        for k, (name, unit) in enumerate(units[:count]):
            found[effort_column(name, unit)] = self.device_forces[..., k]
        reasons = np.array([NO_RESULT.get(str(name), "") for name in self.status.ravel()], dtype=object)
        return found | {"status": self.status.astype(object), "reason": reasons.reshape(self.status.shape)}

    def __str__(self) -> str:
        return contact_table(self)
