"""What is read of robots' files, what is written of chains, and what is said of either, as plain data."""

import re
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
from asked_chains import tried

import exo_pin as ep

_LIMITS = [f"{side}{what}Limit" for what in ("Position", "Velocity", "Effort") for side in ("lower", "upper")]
_DATA = [*_LIMITS, "damping", "armature", "lowerDryFrictionLimit", "upperDryFrictionLimit"]
#: Digits of numbers within texts beyond which machines differ, and what is zero.
_NUMBER = re.compile(r"-?\d+\.\d+(?:e[+-]?\d+)?|-?\d+e[+-]?\d+")
#: What other programs say after it.
FOREIGN = re.compile(r"(not well-formed|MuJoCo cannot read it|not TOML).*")


def _rounded(found):
    value = float(found[0])
    return "0" if abs(value) < 1e-12 else f"{value:.6g}"


def in_short(value):
    """A text, or what Python writes of a value, on one line with numbers of six digits."""
    text = value if isinstance(value, str) else repr(value)
    return " ".join(_NUMBER.sub(_rounded, re.sub(r"/[^ '\"]*/(?=[^/])", "", text)).split())


def said(found):
    """What is found, its texts without folders and without what other programs say."""
    return [FOREIGN.sub(r"\1", in_short(each)) if isinstance(each, str) else each for each in found]


def brief(chain):
    """Tree, data and description of a chain."""
    model, given = chain.model, chain.description
    indices = range(1, model.njoints)
    joints = [f"{model.names[k]} {model.joints[k].shortname()} {model.parents[k]}" for k in indices]
    places = np.array([model.jointPlacements[k].homogeneous[:3].ravel() for k in indices])
    masses = np.array([model.inertias[k].toDynamicParameters() for k in indices])
    frames = [f for f in model.frames if f.type in (pin.FrameType.BODY, pin.FrameType.OP_FRAME)]
    poses = np.array([frame.placement.homogeneous[:3].ravel() for frame in frames])
    data = [np.nan_to_num(getattr(model, name), posinf=1e6, neginf=-1e6).clip(-1e6, 1e6) for name in _DATA]
    at = [[item.key(), item.data()] for item in model.referenceConfigurations]
    words = [given.name, given.root, given.closures, given.roles, given.joints, given.left_out, given.tolerance]
    words += [given.rounding, given.shapes, given.cables]
    return [
        [
            joints,
            places,
            masses,
            [f"{f.name} {f.parentJoint}" for f in frames],
            poses,
            data,
            at,
            np.array(model.gravity.linear),
            list(map(in_short, words)),
        ]
    ]


def read(kind, text, *more, **options):
    """What a text is read as, and again from the file of it with all that may be left out."""

    def asked():
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"robot.{kind}"
            path.write_text(text, encoding="utf-8")
            given = [path] if kind != "urdf" else [path, *(more or (ep.chain.Closures("robot"),))]
            return brief(getattr(ep.ClosedChain, f"from_{'mjcf' if kind == 'xml' else kind}")(*given, **options))

    return said(tried(asked))


def written(chain, q=None):
    """The files of a chain by format, as texts, and what they are read as; an SDF of one without armatures, too."""
    model = chain.model.copy()
    model.armature = np.zeros(model.nv)
    bare = ep.ClosedChain(model, replace(chain.description, joints=chain.description.joints[1:]))

    def asked(kind, *at, chain=chain):
        with tempfile.TemporaryDirectory() as folder:
            path = getattr(chain, f"to_{kind}")(Path(folder) / "robot", *at)
            texts = [in_short(each.read_text(encoding="utf-8")) for each in sorted(path.parent.iterdir())]
            return [[*texts, said(tried(lambda: brief(getattr(ep.ClosedChain, f"from_{kind}")(path))))]]

    at = [] if q is None else [q]
    found = {
        kind: tried(lambda kind=kind, given=given: asked(kind, *given))
        for kind, given in (("urdf", []), ("mjcf", at), ("sdf", at))
    }
    return found | {"bare": tried(lambda: asked("sdf", *at, chain=bare))}
