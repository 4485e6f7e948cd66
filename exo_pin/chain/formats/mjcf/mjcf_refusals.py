"""Parts of a compiled MuJoCo model that are read, and those that raise an error as soon as a file uses them.

:data:`READ` are the fields that the chain is made of. Their numbers have to be finite. Refused is physics that a chain
cannot hold. All other fields of MuJoCo 4.0's mjModel and mjOption do not change the motion of rigid bodies without
contact; ``tests/oracles/mujoco_fields.py`` lists them, and a test compares them with the installed version.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ....core.validation import FloatArray
from .mjcf_compiling import Compiled

__all__ = ["READ", "ranges", "refuse_unreadable"]

#: Fields that are read, of the model and, after "opt.", of its options.
READ = (
    *("nq", "nv", "nbody", "njnt", "nsite", "neq", "nactuator", "nkey", "names", "qpos0", "qpos_spring", "key_qpos"),
    *("body_parentid", "body_pos", "body_quat", "body_ipos", "body_iquat", "body_mass", "body_inertia"),
    *("body_jntnum", "body_jntadr", "jnt_type", "jnt_qposadr", "jnt_dofadr", "jnt_bodyid", "jnt_limited", "jnt_range"),
    *("jnt_margin", "jnt_pos", "jnt_axis", "jnt_stiffness", "jnt_actfrclimited", "jnt_actfrcrange"),
    *("dof_frictionloss", "dof_armature", "dof_damping", "site_bodyid", "site_pos", "site_quat"),
    *("eq_type", "eq_obj1id", "eq_obj2id", "eq_objtype", "eq_active0", "eq_data"),
    *("actuator_trntype", "actuator_trnid", "actuator_outadr", "actuator_gear", "actuator_dyntype"),
    *("actuator_gaintype", "actuator_gainprm", "actuator_biastype", "actuator_biasprm", "actuator_group"),
    *("actuator_ctrladr", "actuator_ctrllimited", "actuator_ctrlrange", "actuator_forcelimited"),
    *("actuator_forcerange", "actuator_damping", "actuator_armature", "actuator_actlimited", "actuator_actrange"),
    *("opt.gravity", "opt.density", "opt.viscosity", "opt.disableflags", "opt.disableactuator"),
)

#: Fields that are places, m and rad, and MuJoCo's own bound for them, mjMAXVAL.
_PLACES = ("qpos0", "qpos_spring", "key_qpos", "body_pos", "body_ipos", "jnt_pos", "site_pos", "eq_data")
_FAR = 1e10

#: Why a property of a free joint cannot be read.
_FREE = "acts along the world's axes in MuJoCo and along the body's axes in Pinocchio: set it to 0"


def refuse_unreadable(source: Compiled) -> None:
    """Raise FileFormatError for the first thing that a chain cannot hold."""
    for check in (_not_finite, _whole_model, _bodies, _joints, _tendons, _equalities, _actuators):
        for message in check(source):
            raise source.error(message)


def _not_finite(source: Compiled) -> Iterator[str]:
    for name in READ:
        owner = source.model.opt if name.startswith("opt.") else source.model
        values = np.atleast_1d(getattr(owner, name.removeprefix("opt.")))
        if values.dtype.kind == "f" and not np.isfinite(values).all():
            index = int(np.argwhere(~np.isfinite(values))[0][0])
            yield f"{name} number {index} is not finite, in MuJoCo's compiled model: {values[index]}"
        elif name in _PLACES and np.abs(values).max(initial=0.0) > _FAR:
            yield f"{name} has {np.abs(values).max():g}, in MuJoCo's compiled model: expected at most {_FAR:g}"


def _whole_model(source: Compiled) -> Iterator[str]:
    model, option = source.model, source.model.opt
    fluid = {"density": option.density, "viscosity": option.viscosity}
    for name, value in fluid.items():
        if value and model.nv:
            yield f"a fluid acts on the bodies (option {name} = {value:g}), which is not read: set {name} to 0"
    if model.nflex:
        yield f"it has {model.nflex} flexes (deformable bodies): only rigid bodies are read"
    if model.nplugin:
        yield f"it has {model.nplugin} plugins, whose forces are not known: remove them"
    if model.nmocap:
        bodies = [source.called("BODY", body) for body in range(model.nbody) if model.body_mocapid[body] >= 0]
        yield f"mocap bodies are moved from outside, which is not read: {', '.join(bodies)}. Remove mocap"
    for flag in ("EQUALITY", "CONSTRAINT"):
        if model.neq and source.disabled(flag):
            yield (
                f"the flag {flag.lower()} is disabled, so that MuJoCo ignores the {model.neq} equalities: remove "
                "them, or enable the flag"
            )
    if model.nactuator and source.disabled("ACTUATION"):
        yield f"the flag actuation is disabled and there are {model.nactuator} actuators: remove them, or enable it"


def _bodies(source: Compiled) -> Iterator[str]:
    for body in np.flatnonzero(source.model.body_gravcomp).tolist():
        yield (
            f"body {source.called('BODY', body)} has gravcomp = {source.model.body_gravcomp[body]:g}, which is not "
            "read: set it to 0, or apply its weight as an external force"
        )


def _joints(source: Compiled) -> Iterator[str]:
    model = source.model
    rigid = np.zeros(model.njnt)
    for joint in range(model.njnt):
        name, kind = source.called("JOINT", joint), source.kind("mjtJoint", model.jnt_type[joint])
        dofs = slice(model.jnt_dofadr[joint], model.jnt_dofadr[joint] + {"free": 6, "ball": 3}.get(kind, 1))
        # MuJoCo 3 has no plastic springs.
        if model.jnt_stiffnesspoly[joint].any() or getattr(model, "jnt_springyield", rigid)[joint]:
            yield f"the spring of joint {name} is not linear (polynomial or plastic): use one stiffness"
        if model.dof_dampingpoly[dofs].any():
            yield f"the damping of joint {name} is not linear: use one coefficient"
        for field in ("armature", "frictionloss", "damping"):
            values = getattr(model, f"dof_{field}")[dofs]
            if (values < 0.0).any():
                yield f"expected a {field} of zero or more for joint {name}, got {values.min():g}"
            if kind == "free" and values.any() and field != "damping":
                yield f"the {field} of free joint {name} {_FREE}"
        if model.jnt_limited[joint] and kind in ("free", "ball"):
            yield f"joint {name} is a ball (or free) joint with a range, which is not read: remove the range"
        if model.jnt_actfrclimited[joint]:
            limits = model.jnt_actfrcrange[joint]
            yield from _without_zero(f"the actuators of joint {name} exert", "actuatorfrcrange", limits)
        if model.jnt_limited[joint] and model.jnt_margin[joint]:
            yield f"the limits of joint {name} have a margin, {model.jnt_margin[joint]:g}: set it to 0"


def _tendons(source: Compiled) -> Iterator[str]:
    """A tendon without any of these is a length that is measured."""
    model = source.model
    acting = ("stiffness", "stiffnesspoly", "damping", "dampingpoly", "frictionloss", "armature", "limited")
    for tendon in range(model.ntendon):
        found = [name for name in acting if np.any(getattr(model, f"tendon_{name}")[tendon])]
        if found:
            name = source.called("TENDON", tendon)
            yield f"tendon {name} has {', '.join(found)}, and forces of tendons are not read: remove it"


def _equalities(source: Compiled) -> Iterator[str]:
    for index, number in enumerate(source.model.eq_type):
        kind = source.kind("mjtEq", number)
        if kind not in ("connect", "weld", "joint"):
            name = source.called("EQUALITY", index)
            yield f"equality {name} is a {kind} coupling: only connect, weld and joint are read"


def _actuators(source: Compiled) -> Iterator[str]:
    model = source.model
    for index in range(model.nactuator):
        name, group = source.called("ACTUATOR", index), int(model.actuator_group[index])
        if source.kind("mjtTrn", model.actuator_trntype[index]) not in ("joint", "jointinparent"):
            yield f"actuator {name} does not act on a joint: only actuators of joints are read"
        elif source.kind("mjtJoint", model.jnt_type[model.actuator_trnid[index, 0]]) not in ("hinge", "slide"):
            joint = source.called("JOINT", int(model.actuator_trnid[index, 0]))
            yield (
                f"actuator {name} acts along one direction of joint {joint}, which has several; an actuated joint is "
                "driven in all: use hinges, or remove the actuator"
            )
        elif not model.actuator_gear[model.actuator_outadr[index], 0]:
            yield f"actuator {name} has a gear of 0 and moves nothing: remove it"
        if 0 <= group < 31 and model.opt.disableactuator >> group & 1:
            yield f"actuator {name} is in group {group}, which is disabled: remove it, or enable the group"
        gain = source.kind("mjtGain", model.actuator_gaintype[index])
        if gain == "fixed" and model.actuator_gainprm[index, 0] == 0.0:
            yield f"actuator {name} has a gain of 0 and exerts nothing: remove it"
        if own := _own_force(source, index):
            yield f"actuator {name} {own}, which is not read: make it a <motor>"
        for field, values in ranges(source, index).items():
            yield from _without_zero(f"actuator {name} exerts", field, values)
        if model.actuator_dampingpoly[index].any():
            yield f"the damping of actuator {name} is not linear: use one coefficient"


def _without_zero(who: str, field: str, limits: FloatArray) -> Iterator[str]:
    if not limits[0] <= 0.0 <= limits[1]:
        yield (
            f"{who} a force without control, because its {field} is {limits[0]:g} to {limits[1]:g}: let the range have "
            "0 in it"
        )


def _own_force(source: Compiled, index: int) -> str:
    """The reason why an actuator's force is not a control times a gain, empty if it is."""
    model = source.model
    known = {
        "Dyn": {"none", "integrator", "filter", "filterexact"},
        "Gain": {"fixed", "affine"},
        "Bias": {"none", "affine"},
    }
    for name, simple in known.items():
        kind = source.kind(f"mjt{name}", getattr(model, f"actuator_{name.lower()}type")[index])
        if kind not in simple:
            return f"has a {name.lower()} of type {kind}"
    if source.kind("mjtBias", model.actuator_biastype[index]) != "none" and model.actuator_biasprm[index].any():
        return "exerts a force without control (a servo, or a general actuator with a bias)"
    return ""


def ranges(source: Compiled, index: int) -> dict[str, FloatArray]:
    """The ranges that limit what an actuator does, by their names in MJCF."""
    model = source.model
    control = int(model.actuator_ctrladr[index])
    found = {}
    if model.actuator_ctrllimited[control] and not source.disabled("CLAMPCTRL"):
        found["ctrlrange"] = model.actuator_ctrlrange[control]
    if model.actuator_forcelimited[index]:
        found["forcerange"] = model.actuator_forcerange[index]
    if model.actuator_actlimited[index] and int(model.actuator_dyntype[index]):
        found["actrange"] = model.actuator_actrange[index]
    return found
