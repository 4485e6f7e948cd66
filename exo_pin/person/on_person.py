"""A device on a musculoskeletal person, as one MJCF: MyoArm with limbs as tendons, drives as actuators, and a cuff.

{O_A} stands at the shoulder's centre of the person who is written, at rest, with its z axis along that of axial
rotation, and {O_B} turns with the humerus. The device's base is part of the thorax. Limbs are tendons without mass
between their joint centres; an actuator's control is the tension in N, positive where it pulls, within what the
design's actuator can do, and the stroke limits the tendon. The cuff is part of the humerus, or sits on it by the
springs of the design's cuff. Nothing is scaled: lengths are the device's and the model's.

MyoArm has helper bodies of 1 g with 1 kg m² each, which turn with the plane of elevation; an arm has 0.3 kg m². With
``bones_only`` they have nothing, and the arm moves as in :class:`exo_pin.Plant`.
"""

from __future__ import annotations

import functools
import operator
import os
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from ..chain.formats.mjcf.mjcf_compiling import mujoco_warnings
from ..core.errors import FileFormatError, InvalidInput, MissingData
from ..core.errors.base import echo
from ..core.errors.checked import checked
from ..core.files import require_ending, require_writable, write_text
from ..core.optional_packages import optional
from ..core.validation import FloatArray, as_choice, as_texts
from ..design import Arm, Mechanism
from ..design.holding_frame import estimated_cuff
from ..device.files.device_export import Exported
from ..reaction.constraints.actuator_limits import length_limits, stroke_limits
from .limb.myoarm_file import person_spec

if TYPE_CHECKING:
    from ..exo.shoulder_exo import ShoulderExo

#: What such a file holds.
ON_PERSON = "Limbs are tendons. Controls are tensions in N, positive where they pull, within what the actuators can do."
#: Groups of the person's joints that can be taken out.
LOCKS = ("scapula", "elbow", "wrist")
#: Joints of the shoulder's angles. What else moves between thorax and humerus is the girdle.
_SHOULDER = ("elv_angle", "shoulder_elv", "shoulder1_r2", "shoulder_rot")
#: Mass and moments of inertia of a body that shall have none, kg and kg m², and the least time constant of a coupling
#: of joints, s, which MuJoCo makes two of its steps.
_NOTHING, _STIFF = 1e-9, 1e-4


@checked
def export_on_person(
    self: ShoulderExo,
    path: str | PathLike[str],
    person: str | PathLike[str] | None = None,
    cuff: str = "weld",
    locked: str | tuple[str, ...] = (),
    bones_only: bool = False,
) -> Exported:
    """Write the device on MyoArm as one MJCF, for MuJoCo and MyoSuite.

    Actuators are called after the limbs, and their controls are tensions in N, positive where they pull. The person's
    joints and muscles keep their names. See :mod:`exo_pin.person.on_person`.

    Parameters
    ----------
    path : path-like
        Where to, an ``.xml`` file.
    person : path-like, optional
        The person's MJCF, with the bodies and joints of MyoArm; that of the package ``myo_sim`` if left out (extra
        ``person``; of a left device both arms). Meshes stay where they are: the file names their place.
    cuff : {"weld", "spring"}
        Whether it is part of the humerus, or held by the stiffness of the design's cuff.
    locked : str or tuple of str
        Joints of the person that are taken out: "scapula" (the girdle), "elbow", "wrist" (and fingers).
    bones_only : bool
        Whether muscles, damping and armature of joints, and the helper bodies' inertia, are left out.

    Returns
    -------
    Exported
        What was written. ``lost`` says what the file lacks or assumes; ``exo.replace(**written.worn)``
        is the device on the arm of this person.

    Raises
    ------
    MissingExtra
        If MuJoCo or ``myo_sim`` is not installed.
    InvalidInput
        If the device is more than limbs between base and arm, or an argument is not usable.
    MissingData
        If the stiffness of the cuff is asked for, and the design has none.
    FileFormatError
        If the file has not the parts of MyoArm.

    Examples
    --------
    >>> import mujoco
    >>> exo = ep.load("four-cables", side="right")
    >>> written = exo.export_on_person("worn.xml", locked=("scapula", "elbow", "wrist"), bones_only=True)
    >>> model = mujoco.MjModel.from_xml_path(str(written[0]))
    >>> [model.actuator(k).name for k in range(model.nu)], model.actuator("limb_1").ctrlrange.tolist()  # N
    (['limb_1', 'limb_2', 'limb_3', 'limb_4'], [0.0, 400.0])
    >>> round(written.worn["arm"].mass, 2)  # kg, of MyoArm's arm and what the device moves
    4.44
    """
    require_ending("the file", path, (".xml",))
    target = Path(path)
    require_writable(target)
    if self.wrist is None or self.wrist.beyond_record:
        raise InvalidInput(
            f"expected a device of limbs between base and arm, got {self.name!r}: export it alone, and weld its arm to "
            "the humerus"
        )
    as_choice("cuff", cuff, ("weld", "spring"))
    chosen = (locked,) if isinstance(locked, str) else as_texts("locked", locked)
    for each in chosen:
        as_choice("locked", each, LOCKS)
    design, left = self.mechanism, self.side == "left"
    found = _Person(person_spec(person, left), "l" if left else "r", None if person is None else os.fsdecode(person))
    on_thorax, on_humerus = found.places()
    found.take_out(chosen, bones_only)
    person_arm, gravity = found.arm(on_thorax)
    base = found.thorax.add_body(name="exo_base", **on_thorax)
    own = [part for part in (() if design.arm is None else design.arm.parts) if part.device]
    moved, origin, said = found.add_cuff(on_humerus, design, cuff == "spring", own)
    found.add_limbs(design, base, moved, origin)
    found.compile()
    lost = () if design.limbs_are_massless else ("the masses of the limbs",)
    whose = "MyoArm of the package myo_sim, Apache License 2.0" if person is None else Path(os.fsdecode(person)).name
    note = f"{self.name} on a person, written by exo_pin. The person is {whose}.".replace("--", "- -")
    write_text(target, f"<!-- {note} -->\n{found.spec.to_xml()}")
    return Exported(
        [target], (), (*lost, *said), {"arm": functools.reduce(operator.add, own, person_arm), "gravity": gravity}
    )


class _Person:
    """A person's model: thorax, humerus and what moves between them and below."""

    def __init__(self, spec: Any, side: str, path: str | None) -> None:
        self._mujoco, self.spec, self._path = optional("person", "mujoco"), spec, path
        #: Names end in the side; a model of a right arm alone may leave it out.
        self._ends = (f"_{side}", "") if side == "r" else (f"_{side}",)
        names = ("clavicle", "humerus", "ulna", "radius")
        clavicle, self._humerus, self._ulna, self._radius = (self._part(spec.body, name) for name in names)
        self.thorax = clavicle.parent
        self._shoulder = [self._part(spec.joint, name) for name in _SHOULDER]

    def _part(self, find: Any, name: str) -> Any:
        found = next((part for end in self._ends if (part := find(name + end)) is not None), None)
        if found is None:
            raise FileFormatError(f"expected a person with {name}{self._ends[0]}, as MyoArm has", self._path)
        return found

    def compile(self) -> Any:
        """The model."""
        try:
            with mujoco_warnings(self._mujoco, []):
                return self.spec.compile()
        except ValueError as error:
            raise FileFormatError(f"MuJoCo cannot compile it: {echo(str(error))}", self._path) from error

    def _at_rest(self) -> tuple[Any, Any]:
        """The model, and its data with all joints at zero."""
        model = self.compile()
        data = self._mujoco.MjData(model)
        data.qpos[:] = model.qpos0
        self._mujoco.mj_kinematics(model, data)
        self._mujoco.mj_comPos(model, data)
        return model, data

    def places(self) -> tuple[dict[str, Any], dict[str, Any]]:
        """Places of {O_A} in the thorax and of {O_B} in the humerus, as a body takes them."""
        _, data = self._at_rest()
        centre, elbow = data.xpos[self._humerus.id], data.xpos[self._ulna.id]
        up = data.xaxis[self._shoulder[0].id]
        up = up * np.sign(up @ (centre - elbow))
        forward = data.xmat[self.thorax.id].reshape(3, 3)[:, 0]
        forward = forward - forward @ up * up
        forward /= np.linalg.norm(forward)
        axes = np.stack([forward, np.cross(up, forward), up], axis=1)
        found = []
        for body in (self.thorax, self._humerus):
            R = data.xmat[body.id].reshape(3, 3)
            x, y, z, w = Rotation.from_matrix(R.T @ axes).as_quat().tolist()
            found.append({"pos": R.T @ (centre - data.xpos[body.id]), "quat": [w, x, y, z]})
        return found[0], found[1]

    def arm(self, on_thorax: dict[str, Any]) -> tuple[Arm, FloatArray]:
        """The arm from the shoulder on at rest, in {O_B}, and gravity in {O_A}, both with all joints at zero."""
        model, data = self._at_rest()
        quaternion = on_thorax["quat"]
        A = data.xmat[self.thorax.id].reshape(3, 3) @ Rotation.from_quat(quaternion, scalar_first=True).as_matrix()
        parts = [self._humerus.id]
        for body in range(self._humerus.id + 1, model.nbody):
            if model.body_parentid[body] in parts:
                parts.append(body)
        mass, places = model.body_mass[parts], data.xipos[parts]
        centre = mass @ places / mass.sum()
        inertia = np.zeros((3, 3))
        for body, m, off in zip(parts, mass, places - centre, strict=True):
            R = data.ximat[body].reshape(3, 3)
            inertia += R * model.body_inertia[body] @ R.T + m * (off @ off * np.eye(3) - np.outer(off, off))
        at = A.T @ (centre - data.xpos[self._humerus.id])
        return Arm(float(mass.sum()), at, A.T @ inertia @ A), np.asarray(A.T @ model.opt.gravity)

    def take_out(self, groups: tuple[str, ...], bones_only: bool) -> None:
        """Lock joints, and leave muscles and what is no bone out."""
        spec, shoulder = self.spec, [joint.name for joint in self._shoulder]
        girdle, helpers, body = [], [], self._humerus
        while body.name != self.thorax.name:
            girdle += [joint for joint in body.joints if joint.name not in shoulder]
            helpers += [body] if any(joint.name in shoulder for joint in body.joints) else []
            body = body.parent
        below = [joint for joint in spec.joints if self._hangs_from_ulna(joint.parent)]
        elbow = [joint for joint in below if joint.parent.name in (self._ulna.name, self._radius.name)]
        wrist = [joint for joint in below if joint not in elbow]
        gone = [joint for group in groups for joint in dict(zip(LOCKS, (girdle, elbow, wrist), strict=True))[group]]
        names = {joint.name for joint in gone}
        refer = [each for each in spec.equalities if {each.name1, each.name2} & names]
        refer += [each for each in spec.actuators if each.target in names]
        refer += [each for each in spec.sensors if each.objname in names]
        if bones_only:
            for joint in spec.joints:
                joint.damping, joint.armature = np.zeros(3), 0.0
            for body in helpers[1:]:
                body.explicitinertial, body.mass, body.inertia = 1, _NOTHING, np.full(3, _NOTHING)
            for each in spec.equalities:
                each.solref = [_STIFF, 1.0]
            refer += list(spec.actuators)
            refer += [each for each in spec.tendons if each.name in {drive.target for drive in spec.actuators}]
        for each in (*{id(part): part for part in refer}.values(), *gone):
            spec.delete(each)
        if gone:
            for key in list(spec.keys):
                spec.delete(key)

    def _hangs_from_ulna(self, body: Any) -> bool:
        while body is not None and body.name not in (self._ulna.name, "world"):
            body = body.parent
        return body is not None and body.name == self._ulna.name

    def add_cuff(
        self, place: dict[str, Any], design: Mechanism, soft: bool, own: list[Arm]
    ) -> tuple[Any, FloatArray, tuple[str, ...]]:
        """The body of the cuff, the origin of {O_B} in it, and what is lost; ``own`` is what the device moves."""
        spring, said = design.interfaces.cuff, tuple[str, ...]()
        body = self._humerus.add_body(name="exo_arm", **place)
        at = np.zeros(3)
        if soft:
            if spring is None:
                raise MissingData(["the stiffness of the cuff (interfaces.cuff)"], "a cuff on springs", design.name)
            stiffness = np.diag(spring.stiffness)
            if (spring.stiffness != np.diag(stiffness)).any():
                raise InvalidInput("expected a cuff without coupling between its axes: MuJoCo has a spring a joint")
            at, said = np.asarray(spring.at), ("the damping of the cuff, which the design does not state",)
            if not own:
                own, said = (
                    [estimated_cuff(design.geometry)],
                    (*said, "the cuff's true mass: that by its geometry is written"),
                )
            for key in list(self.spec.keys):
                self.spec.delete(key)
        body = body.add_body(name="exo_cuff", pos=at)
        if soft:
            kinds = [self._mujoco.mjtJoint.mjJNT_SLIDE] * 3 + [self._mujoco.mjtJoint.mjJNT_HINGE] * 3
            for k, kind in enumerate(kinds):
                joint = body.add_joint(name=f"exo_cuff_{k}", type=kind, axis=np.eye(3)[k % 3])
                joint.stiffness, joint.damping = np.array([stiffness[k], 0.0, 0.0]), np.zeros(3)
                joint.armature, joint.limited = 0.0, 0
        if own:
            whole = functools.reduce(operator.add, own)
            if whole.inertia is None:
                raise MissingData(["the inertia of what the device moves"], "the device on a person", design.name)
            (xx, xy, xz), (_, yy, yz), (_, _, zz) = whole.inertia.tolist()
            body.mass, body.ipos, body.explicitinertial = whole.mass, whole.centre_of_mass - at, 1
            body.fullinertia = [xx, yy, zz, xy, xz, yz]
        return body, -at, said

    def add_limbs(self, design: Mechanism, base: Any, moved: Any, origin: FloatArray) -> None:
        """Limbs as tendons, each with its actuator."""
        joints = zip(design.geometry.base_points, design.geometry.platform_points, strict=True)
        limits = zip(*stroke_limits(design), *length_limits(design), strict=True)
        for i, ((a, b), (least, greatest, *ends)) in enumerate(zip(joints, limits, strict=True), 1):
            name = f"limb_{i}"
            base.add_site(name=f"{name}_base", pos=a)
            moved.add_site(name=f"{name}_platform", pos=origin + b)
            tendon = self.spec.add_tendon(name=name, limited=0, width=0.002, rgba=[0.2, 0.2, 0.22, 1.0])
            for end in ("base", "platform"):
                tendon.wrap_site(f"{name}_{end}")
            drive = self.spec.add_actuator(name=name, target=name, trntype=self._mujoco.mjtTrn.mjTRN_TENDON)
            drive.set_to_motor()
            # A force of MuJoCo's tendon is positive where it lengthens.
            drive.gear[0] = -1.0
            if np.isfinite((least, greatest)).all():
                drive.ctrllimited, drive.ctrlrange = 1, (least, greatest)
            if np.isfinite(ends).all():
                tendon.limited, tendon.range = 1, ends
