"""Pinocchio's Data of a large tree, without its arrays of nv³ numbers.

The constructor of ``pinocchio.Data`` allocates and fills four tensors of nv³ numbers for second derivatives of RNEA,
which nothing here computes: 824 MB for 300 coordinates. No argument of it leaves them out, but an archive can: this
module writes the text archive of a new Data with empty tensors, and ``loadFromString`` allocates what is in it.

The layout of the archive is learned from Pinocchio itself: a probe, a small model with one joint of every class of the
tree, is saved as XML, where every member has its name and sizes, and its members are repeated to the size of the tree.
The same procedure has to reproduce the probe's own archive, word by word. If it does not, as for another release of
Pinocchio, and for composite and mimic joints, the constructor makes the Data.

Left out are second derivatives of RNEA, kinematic Hessians, regressors and the couplings of Delassus operators; and
what no archive holds, the memory of ``pinocchio.cholesky``, ``pinocchio.pv`` and CasADi. Pinocchio does not check
sizes, so such a Data must not be given to functions that need these. Kinematics, RNEA, CRBA, their first derivatives,
energies and constrained dynamics do not.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree.ElementTree import Element, iterparse

import numpy as np
import pinocchio as pin

#: Trees with more coordinates have a compact Data: the four tensors of 64 coordinates take 8 MB.
_LARGE = 64
#: Classes of joints that hold other joints, which the probe does not reproduce.
_NESTED = ("JointModelComposite", "JointModelMimic")
#: Members that become empty.
_LEFT_OUT = frozenset(
    {
        "d2tau_dqdq",
        "d2tau_dvdv",
        "d2tau_dqdv",
        "d2tau_dadq",
        "kinematic_hessians",
        "staticRegressor",
        "jointTorqueRegressor",
        "joint_cross_coupling",
        "joint_coupling_info",
        "projected_joint_cross_coupling",
        "joint_apparent_inertia",
    }
)
#: Joints of one small model from which the words of joints are read.
_BATCH = 8
_HEAD = "22 serialization::archive 20"
Words = list[str]
#: Of joints with the same new data: class, and axis and pitch.
Key = tuple[str, bytes]


class _Tree(NamedTuple):
    """What the archive of a model's Data is made from: integers by member, the joints' keys, and data by key."""

    model: pin.Model
    arrays: dict[str, list[Any]]
    keys: list[Key]
    joints: dict[Key, Element]


def data_for(model: pin.Model) -> pin.Data:
    """A new Data of a tree, compact if it is large and a temporary file can be written."""
    try:
        found = compact_data(model) if model.nv > _LARGE else None
    except OSError:
        found = None
    # Not createData(), which makes two and copies one.
    return pin.Data(model) if found is None else found


def compact_data(model: pin.Model) -> pin.Data | None:
    """A new Data without arrays of nv³ numbers; None if the archive is not as expected, or with nested joints."""
    if model.njoints < 2 or any(joint.shortname() in _NESTED for joint in model.joints):
        return None
    first: dict[str, Any] = {}
    for joint in list(model.joints)[1:]:
        first.setdefault(joint.shortname(), joint)
    probe = _small_model(first.values())
    archive, tree = _archive(pin.Data(probe)), _tree(probe)
    kept = [member for member in archive if member.tag not in _LEFT_OUT]
    if [_words(member) for member in kept] != [_member(member, tree) for member in kept]:
        return None
    text, tree = [_HEAD, *_opening(archive)], _tree(model)
    for member in archive:
        text += _member(member, tree)
    data = pin.Data()
    data.loadFromString(" ".join(text))
    return data


def _small_model(joints: Iterable[Any]) -> pin.Model:
    """A model with given joints, in two branches."""
    model = pin.Model()
    for k, joint in enumerate(joints):
        model.addJoint(max(k - 1, 0), joint, pin.SE3.Identity(), f"joint_{k}")
    return model


def _archive(data: pin.Data, last: str = "") -> Element:
    """A Data as XML, up to the member ``last``."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "data.xml"
        data.saveToXML(str(path), "data")
        with path.open("rb") as file:
            reading = iterparse(file, events=("start", "end"))
            (_, _), (_, root) = next(reading), next(reading)
            for event, element in reading:
                if event == "end" and element.tag == last:
                    break
    return root


# Words of the text archive. Boost writes the version of a class where it occurs first, and a number for every joint.


def _opening(element: Element, number: int | None = None) -> Words:
    """Words before the content of an element, with the number of a joint if it is not that of the XML."""
    given = element.attrib
    found = [given["tracking_level"], given["version"]] if "class_id" in given else []
    if "object_id" in given:
        found.append(given["object_id"][1:] if number is None else str(number))
    return found


def _words(element: Element, number: int | None = None) -> Words:
    """An element as the XML has it; memory that nothing has filled, which may be no number, as zero."""
    found: Words = []
    for part in element.iter():
        found += _opening(part, number)
        if part.text and part.text.strip():
            found.append(_word(float(part.text)))
    return found


def _word(value: float) -> str:
    if not math.isfinite(value):
        return "0"
    return str(int(value)) if value == int(value) else repr(value)


def _member(member: Element, tree: _Tree) -> Words:
    """A member of a model's Data, given that of the probe's."""
    model = tree.model
    if member.tag in _LEFT_OUT:
        return _emptied(member)
    if member.tag in tree.arrays:
        return _integers(member, tree.arrays[member.tag])
    if member.tag in ("joints", "joints_augmented"):
        found = _joints(member, tree)
    elif member.find("item") is not None:
        items = member.findall("item")[:2]
        first, second = _resized(items[0], model), _resized(items[-1], model)
        found = [first] + [second] * ((model.nframes if member.tag == "oMf" else model.njoints) - 1)
        if member.tag == "a_gf":
            found[0] = found[0][: -len(second)] + [_word(-value) for value in model.gravity.vector.tolist()]
    else:
        return _resized(member, model)
    return [*_opening(member), str(len(found)), *_words(member[1]), *(word for item in found for word in item)]


def _emptied(element: Element) -> Words:
    """An element with sizes of zero."""
    found = _opening(element)
    if element.tag in ("count", "rows", "cols", "memory_capacity"):
        return [*found, "0"]
    if element.tag == "elems":  # the three sizes of a tensor
        return [*found, "3", "0", "0", "0"]
    if element.tag == "item_version":
        return _words(element)
    return found + [word for part in element if part.tag != "item" for word in _emptied(part)]


def _resized(element: Element, model: pin.Model) -> Words:
    """An element, in which the sizes of vectors and matrices that are not zero become nv, or nq for q."""
    rows, columns, values = (element.find(tag) for tag in ("rows", "cols", "data"))
    if values is None or (rows is None and columns is None):
        return _words(element)
    sizes = [int(size.text or "0") for size in (rows, columns) if size is not None]
    if not all(sizes):
        return _words(element)
    own = model.nq if element.tag == "q_in" else model.nv
    numbers = ["0"] * (len(values) // math.prod(sizes) * own ** len(sizes))
    if element.tag == "U":  # of M, the identity at first
        numbers[:: own + 1] = ["1"] * own
    elif element.tag == "q_in":
        numbers = [_word(value) for value in pin.neutral(model).tolist()]
    return [*_opening(element), *[str(own)] * len(sizes), *_opening(values), *numbers]


def _integers(member: Element, values: list[Any]) -> Words:
    """A vector of integers, or of vectors of integers."""
    found = [*_opening(member), str(len(values)), "0"]
    for k, value in enumerate(values):
        if isinstance(value, list):
            found += [*(_opening(member[2]) if k == 0 else []), str(len(value)), "0", *map(str, value)]
        else:
            found.append(str(value))
    return found


# Joints, and the arrays of integers that describe the tree.


def _tree(model: pin.Model) -> _Tree:
    keys = [(joint.shortname(), np.asarray(joint.createData().S).tobytes()) for joint in model.joints]
    distinct = list(dict(zip(keys[1:], list(model.joints)[1:], strict=True)).items())
    joints: dict[Key, Element] = {}
    for start in range(0, len(distinct), _BATCH):
        some = distinct[start : start + _BATCH]
        # Of the two lists of joints in an archive, the second has no versions of classes.
        again = _archive(pin.Data(_small_model(joint for _, joint in some)), "joints_augmented")
        joints.update(zip((key for key, _ in some), again.findall("joints_augmented/item")[1:], strict=True))
    return _Tree(model, _tree_arrays(model), keys, joints)


def _joints(member: Element, tree: _Tree) -> list[Words]:
    """Words of all joints' data: the world's, the first of each class as in the probe, others without versions."""
    given, versions = member.findall("item"), member.tag == "joints"
    names = [name for name, _ in tree.keys[1:]]
    firsts = {name: given[k] for k, name in enumerate(dict.fromkeys(names), 1)} if versions else {}
    items = [given[0], *(firsts.pop(key[0], tree.joints[key]) for key in tree.keys[1:])]
    return [_words(item, number) for number, item in enumerate(items, 0 if versions else len(items))]


def _tree_arrays(model: pin.Model) -> dict[str, list[Any]]:
    """Members that describe the tree: by joint, or by coordinate of v ("fromRow")."""
    parents, sizes = list(model.parents), [joint.nv for joint in model.joints]
    last, subtree = list(range(model.njoints)), sizes.copy()
    for joint in range(model.njoints - 1, 0, -1):
        last[parents[joint]] = max(last[parents[joint]], last[joint])
        subtree[parents[joint]] += subtree[joint]
    subtree[0] *= 2  # as Pinocchio counts, for which the world is its own parent and has a coordinate
    rows = [(model.idx_vs[joint], place, joint) for joint in range(1, model.njoints) for place in range(sizes[joint])]
    above = [model.idx_vs[parent] + sizes[parent] - 1 if parent else -1 for parent in parents]
    before = [above[joint] if place == 0 else row - 1 for row, (_, place, joint) in enumerate(rows)]
    supports: list[list[int]] = []
    for row, parent in enumerate(before):
        supports.append([*(supports[parent] if parent >= 0 else []), row])
    return {
        "lastChild": last,
        "nvSubtree": subtree,
        "start_idx_v_fromRow": [first for first, _, _ in rows],
        "end_idx_v_fromRow": [first + sizes[joint] - 1 for first, _, joint in rows],
        "parents_fromRow": before,
        "non_mimic_parents_fromRow": before,
        "mimic_parents_fromRow": [row - 1 if place else -1 for row, (_, place, _) in enumerate(rows)],
        "idx_vExtended_to_idx_v_fromRow": list(range(len(rows))),
        "nvSubtree_fromRow": [subtree[joint] - place for _, place, joint in rows],
        "supports_fromRow": supports,
    }
