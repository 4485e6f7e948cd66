"""What of a compiled MuJoCo model a chain cannot hold: it is switched off in the model, or refused.

The numbers that the chain is made of have to be finite. Physics that a chain cannot hold is refused unless the caller
leaves it out by name; then it is switched off in MuJoCo's model, too, so that the two can be compared. All other fields
of MuJoCo 4.0's mjModel and mjOption do not change the motion of rigid bodies without contact; ``mujoco_fields.yaml``
beside its tests lists them all, and a test compares them with the installed version.
"""

from __future__ import annotations

from operator import attrgetter

import numpy as np

from ....core.validation import FloatArray
from ...structure.description import Cable
from ..leaving_out import LeftOut
from .mjcf_compiling import Compiled

#: Numbers that are read, of the model and, after "opt.", of its options.
_READ = (
    "qpos0", "qpos_spring", "key_qpos", "body_pos", "body_quat", "body_ipos", "body_iquat", "body_mass",
    "body_inertia", "jnt_range", "jnt_margin", "jnt_pos", "jnt_axis", "jnt_stiffness", "jnt_actfrcrange",
    "dof_frictionloss", "dof_armature", "dof_damping", "site_pos", "site_quat", "tendon_stiffness", "tendon_length0",
    "tendon_lengthspring", "eq_data", "actuator_gear", "actuator_gainprm", "actuator_biasprm", "actuator_ctrlrange",
    "actuator_forcerange", "actuator_damping", "actuator_armature", "actuator_actrange", "opt.gravity", "opt.density",
    "opt.viscosity",
)  # fmt: skip
#: Fields that are places, m and rad, and MuJoCo's own bound for them, mjMAXVAL.
_PLACES = ("qpos0", "qpos_spring", "key_qpos", "body_pos", "body_ipos", "jnt_pos", "site_pos", "eq_data")
_FAR = 1e10

#: Why a property of a free joint cannot be read.
_FREE = "acts along the world's axes in MuJoCo and along the body's axes in Pinocchio"


def settle(source: Compiled, left: LeftOut) -> None:
    """Switch off in the compiled model what is left out.

    Raises
    ------
    FileFormatError
        For the first thing that a chain cannot hold and the caller does not leave out.
    """
    for part in (_finite, _whole_model, _joints, _actuators, _tendons, _equalities):
        part(source, left)
    if left.has("free_joint_rotors", "actuator_rotors"):
        # Of a body alone in the world MuJoCo computed the mass matrix beforehand.
        source.mujoco.mj_setConst(source.model, source.mujoco.MjData(source.model))


def _finite(source: Compiled, left: LeftOut) -> None:
    for name in _READ:
        values = np.atleast_1d(attrgetter(name)(source.model))
        if not np.isfinite(values).all():
            index = int(np.argwhere(~np.isfinite(values))[0][0])
            raise source.error(f"{name} number {index} is not finite, in MuJoCo's compiled model: {values[index]}")
        if name in _PLACES and np.abs(values).max(initial=0.0) > _FAR:
            most = np.abs(values).max()
            raise source.error(f"{name} has {most:g}, in MuJoCo's compiled model: expected at most {_FAR:g}")


def _whole_model(source: Compiled, left: LeftOut) -> None:
    model, option = source.model, source.model.opt
    for name in ("density", "viscosity"):
        value = getattr(option, name)
        if value and model.nv:
            left.named("fluid", f"a fluid acts on the bodies (option {name} = {value:g})", f"set {name} to 0")
        setattr(option, name, 0.0)
    if model.nflex:
        raise source.error(f"it has {model.nflex} flexes (deformable bodies): only rigid bodies are read")
    forces = np.concatenate([model.body_plugin, model.actuator_plugin])
    if (forces >= 0).any():
        raise source.error(f"it has {model.nplugin} plugins, whose forces are not known: remove them")
    for body in np.flatnonzero(model.body_mocapid >= 0).tolist():
        left.say("mocap", f"body {source.called('BODY', body)}, which is moved from outside, stands still")
    colliding = int(np.count_nonzero((model.geom_contype != 0) | (model.geom_conaffinity != 0)))
    if colliding and not (source.disabled("CONTACT") or source.disabled("CONSTRAINT")):
        left.say("contact", f"{colliding} geoms collide in MuJoCo")
    for body in np.flatnonzero(model.body_gravcomp).tolist():
        what = f"body {source.called('BODY', body)} has gravcomp = {model.body_gravcomp[body]:g}"
        left.named("gravcomp", what, "set it to 0, or apply its weight as an external force")
    model.body_gravcomp[:] = 0.0


def _joints(source: Compiled, left: LeftOut) -> None:
    model = source.model
    # MuJoCo 3 has no plastic springs.
    plastic = getattr(model, "jnt_springyield", np.zeros(model.njnt))
    for joint in range(model.njnt):
        name, kind = source.called("JOINT", joint), source.kind("mjtJoint", model.jnt_type[joint])
        first = int(model.jnt_dofadr[joint])
        if model.jnt_stiffnesspoly[joint].any() or plastic[joint]:
            what = f"the spring of joint {name} is not linear (polynomial or plastic)"
            left.named("nonlinear_springs", what, "use one stiffness")
        if model.dof_dampingpoly[first].any():
            left.named("nonlinear_springs", f"the damping of joint {name} is not linear", "use one coefficient")
        for field in ("armature", "frictionloss", "damping"):
            # A joint states one for all its directions.
            values = getattr(model, f"dof_{field}")
            if values[first] < 0.0:
                raise source.error(f"expected a {field} of zero or more for joint {name}, got {values[first]:g}")
            if kind == "free" and field != "damping" and values[first]:
                left.named("free_joint_rotors", f"the {field} of free joint {name} {_FREE}", "set it to 0")
                values[model.dof_jntid == joint] = 0.0
        if model.jnt_limited[joint] and kind in ("free", "ball"):
            left.named("ball_limits", f"joint {name} is a ball (or free) joint with a range", "remove the range")
            model.jnt_limited[joint] = 0
        if model.jnt_actfrclimited[joint] and not _has_zero(model.jnt_actfrcrange[joint]):
            low, high = model.jnt_actfrcrange[joint]
            what = f"the actuators of joint {name} exert a force without control, its actuatorfrcrange is"
            left.named("idle_forces", f"{what} {low:g} to {high:g}", "let the range have 0 in it")
            model.jnt_actfrclimited[joint] = 0
        (low, high), margin = model.jnt_range[joint], model.jnt_margin[joint]
        if model.jnt_limited[joint] and not low + margin <= high - margin:
            raise source.error(f"the margin of the limits of joint {name} leaves it no range: expected less")
    model.jnt_stiffnesspoly[:] = model.dof_dampingpoly[:] = 0.0
    plastic[:] = 0


def cables(source: Compiled) -> dict[int, Cable]:
    """Tendons over sites alone that an actuator can pull or that are springs, by number; their links by MuJoCo's.

    An actuator's force acts along the growing length; of one that can push as well the pull is read, and one without
    gain is a spring of constant force. A spring has one length at which it is slack, or is slack up to a length, as a
    cord. A tendon of one joint is a spring in it.
    """
    model, found = source.model, dict[int, Cable]()
    for tendon in range(model.ntendon):
        kinds, ids = _wraps(source, tendon)
        is_of_one = kinds == {"joint"} and len(ids) == 1 and model.wrap_prm[model.tendon_adr[tendon]] == 1.0
        joint = str(ids[0]) if is_of_one else None
        if joint is None and (len(ids) < 2 or kinds != {"site"}):
            continue
        sites = ids if joint is None else []
        points = tuple((str(model.site_bodyid[site]), tuple(model.site_pos[site].tolist())) for site in sites)
        low, high = model.tendon_lengthspring[tendon].tolist()
        stiffness = 0.0 if source.disabled("SPRING") else float(model.tendon_stiffness[tendon])
        if stiffness and low not in (high, 0.0):
            continue
        acting = [k for k in range(model.nactuator) if _tendon_of(source, k) == tendon]
        constants = {k: _constant_force(source, k) for k in acting}
        pulls = [effort_range(source, k) for k, own in constants.items() if not own]
        force = np.sum(pulls, axis=0) if pulls else np.zeros(2)
        tension = (max(0.0, -float(force[1])), -float(force[0])) if force[0] < 0.0 and joint is None else None
        constant = float(sum(constants.values()))
        if stiffness or constant or tension is not None:
            name = source.name("TENDON", tendon) or f"tendon_{tendon}"
            length, slack = (high, low != high) if stiffness else (0.0, False)
            found[tendon] = Cable(name, points, tension, stiffness, length, slack, constant=constant, joint=joint)
    return found


def _wraps(source: Compiled, tendon: int) -> tuple[set[str], list[int]]:
    """What a tendon goes over: kinds of objects, and their numbers."""
    first = int(source.model.tendon_adr[tendon])
    own = slice(first, first + int(source.model.tendon_num[tendon]))
    return {source.kind("mjtWrap", kind) for kind in source.model.wrap_type[own]}, source.model.wrap_objid[own].tolist()


def _law(source: Compiled, index: int) -> list[str]:
    """Kinds of an actuator's gain and bias."""
    return [
        source.kind(f"mjt{name}", getattr(source.model, f"actuator_{name.lower()}type")[index])
        for name in ("Gain", "Bias")
    ]


def _constant_force(source: Compiled, index: int) -> float:
    """The tension of an actuator that has a bias and no gain, N or N m; 0 of any other."""
    model = source.model
    bias = model.actuator_biasprm[index]
    if _law(source, index) != ["fixed", "affine"] or model.actuator_gainprm[index, 0] or bias[1:].any():
        return 0.0
    if source.disabled("ACTUATION") or model.actuator_forcelimited[index]:
        return 0.0
    return -float(bias[0] * model.actuator_gear[model.actuator_outadr[index], 0])


def _tendon_of(source: Compiled, index: int) -> int:
    """The tendon that an actuator acts on, -1 for none."""
    acts = source.kind("mjtTrn", source.model.actuator_trntype[index]) == "tendon"
    return int(source.model.actuator_trnid[index, 0]) if acts else -1


def _tendons(source: Compiled, left: LeftOut) -> None:
    """A tendon without any of these is a length that is measured."""
    model, read = source.model, cables(source)
    if read:
        left.say("cables", ", ".join(repr(own.name) for own in read.values()))
    acting = ("stiffness", "stiffnesspoly", "damping", "dampingpoly", "frictionloss", "armature", "limited")
    for tendon in range(model.ntendon):
        found = [name for name in acting if np.any(getattr(model, f"tendon_{name}")[tendon])]
        if tendon in read and "stiffness" in found:
            found.remove("stiffness")
        if found:
            what = f"tendon {source.called('TENDON', tendon)} has {', '.join(found)}"
            left.named("tendons", what, "forces of tendons are not read; remove it")
    for name in acting:
        getattr(model, f"tendon_{name}")[:] = 0


def distance(source: Compiled, index: int) -> tuple[int, int, float] | None:
    """Two sites and their distance, m, of an equality of a tendon's length; None if it holds anything else."""
    model = source.model
    tendon = int(model.eq_obj1id[index])
    kinds, ids = _wraps(source, tendon)
    length = float(model.tendon_length0[tendon] + model.eq_data[index, 0])
    if model.eq_obj2id[index] >= 0 or len(ids) != 2 or kinds != {"site"} or length <= 0.0:
        return None
    return ids[0], ids[1], length


def _equalities(source: Compiled, left: LeftOut) -> None:
    model = source.model
    ignored = source.disabled("EQUALITY") or source.disabled("CONSTRAINT")
    for index, number in enumerate(model.eq_type):
        kind, called = source.kind("mjtEq", number), source.called("EQUALITY", index)
        if ignored or not model.eq_active0[index]:
            left.say("inactive", f"equality {called}, which is not active")
            model.eq_active0[index] = 0
        elif kind == "tendon" and distance(source, index) is None:
            what = f"equality {called} is a {kind} coupling"
            left.named("tendons", what, "of tendons only a constant length between two sites is read; remove it")
            model.eq_active0[index] = 0
        elif kind not in ("connect", "weld", "joint", "tendon"):
            raise source.error(f"equality {called} is a {kind} coupling: only connect, weld and joint are read")


def _actuators(source: Compiled, left: LeftOut) -> None:
    """How a control becomes a force is not read: the efforts of a chain are given as forces."""
    model, driving = source.model, drives(source)
    pulled = [tendon for tendon, own in cables(source).items() if own.tension is not None or own.constant]
    for index in range(model.nactuator):
        called = f"actuator {source.called('ACTUATOR', index)}"
        if index not in driving:
            if _tendon_of(source, index) not in pulled:
                left.say("actuators", f"{called} {_why_not(source, index)}")
            if _why_not(source, index).startswith("acts"):
                if model.actuator_armature[index] or model.actuator_damping[index]:
                    what = f"{called} acts on no hinge or slide, and has a rotor or damping"
                    left.named("actuator_rotors", what, "set its armature and damping to 0")
                model.actuator_armature[index] = model.actuator_damping[index] = 0.0
        elif _is_servo(source, index):
            left.say("control_laws", f"{called} exerts a force without control in MuJoCo")
        for field, limits in ranges(source, index).items():
            # Of a cable it is the least tension.
            if not _has_zero(limits) and _tendon_of(source, index) not in pulled:
                what = f"{called} exerts a force without control: its {field} is {limits[0]:g} to {limits[1]:g}"
                left.named("idle_forces", what, "let the range have 0 in it")
                at = int(model.actuator_ctrladr[index]) if field == "ctrlrange" else index
                getattr(model, f"actuator_{field.removesuffix('range')}limited")[at] = 0
        if model.actuator_dampingpoly[index].any():
            left.named("nonlinear_springs", f"the damping of {called} is not linear", "use one coefficient")
    model.actuator_dampingpoly[:] = 0.0


def drives(source: Compiled) -> dict[int, int]:
    """The actuators that exert efforts on a hinge or slide, and its number."""
    model = source.model
    return {k: int(model.actuator_trnid[k, 0]) for k in range(model.nactuator) if not _why_not(source, k)}


def _why_not(source: Compiled, index: int) -> str:
    """Why an actuator exerts no effort on a hinge or slide; empty if it does."""
    model, group = source.model, int(source.model.actuator_group[index])
    kind = source.kind("mjtTrn", model.actuator_trntype[index])
    if kind not in ("joint", "jointinparent"):
        return f"acts on a {kind}: give its force as an external one"
    if _several(source, index):
        joint = source.called("JOINT", int(model.actuator_trnid[index, 0]))
        return f"acts along one direction of joint {joint}, which has several"
    if not model.actuator_gear[model.actuator_outadr[index], 0]:
        return "has a gear of 0"
    if source.disabled("ACTUATION"):
        return "exerts nothing, because the flag actuation is disabled"
    if group >= 0 and model.opt.disableactuator >> group & 1:
        return f"is in group {group}, which is disabled"
    is_idle = _law(source, index)[0] == "fixed" and model.actuator_gainprm[index, 0] == 0.0
    return "has a gain of 0" if is_idle else ""


def _several(source: Compiled, index: int) -> bool:
    joint = int(source.model.actuator_trnid[index, 0])
    return source.kind("mjtJoint", source.model.jnt_type[joint]) not in ("hinge", "slide")


def _is_servo(source: Compiled, index: int) -> bool:
    """Whether an actuator's force is no control times a gain."""
    gain, bias = _law(source, index)
    return gain not in ("fixed", "affine") or (bias != "none" and bool(source.model.actuator_biasprm[index].any()))


def _has_zero(limits: FloatArray) -> bool:
    return bool(limits[0] <= 0.0 <= limits[1])


def effort_range(source: Compiled, index: int) -> FloatArray:
    """Range of an actuator's effort on its joint or tendon, shape (2,), N or N m.

    A control range limits the force of a motor (a constant gain, no dynamics), an activation range that of an
    actuator with dynamics and a constant gain; a force range limits every one.
    """
    theirs, found, limits = source.model, ranges(source, index), np.array([-np.inf, np.inf])
    dynamic = source.kind("mjtDyn", theirs.actuator_dyntype[index]) != "none"
    driven = found.get("actrange" if dynamic else "ctrlrange")
    if _law(source, index)[0] == "fixed" and driven is not None:
        limits = theirs.actuator_gainprm[index, 0] * driven
    if "forcerange" in found:
        limits = np.clip(np.sort(limits), *found["forcerange"])
    return np.sort(limits * theirs.actuator_gear[theirs.actuator_outadr[index], 0])


def ranges(source: Compiled, index: int) -> dict[str, FloatArray]:
    """The ranges that limit what an actuator does, by their names in MJCF; of a servo that of its force."""
    model = source.model
    control = int(model.actuator_ctrladr[index])
    found = {}
    if model.actuator_forcelimited[index]:
        found["forcerange"] = model.actuator_forcerange[index]
    if _is_servo(source, index):
        return found
    if model.actuator_ctrllimited[control] and not source.disabled("CLAMPCTRL"):
        found["ctrlrange"] = model.actuator_ctrlrange[control]
    if model.actuator_actlimited[index] and int(model.actuator_dyntype[index]):
        found["actrange"] = model.actuator_actrange[index]
    return found
