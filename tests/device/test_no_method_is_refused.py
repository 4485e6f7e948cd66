"""What is an attribute of a device has an answer for it: no method says that it is of wrists alone."""

import inspect
import warnings

import numpy as np
import pytest
from places import URDF

import exo_pin as ep

MAN = ep.Wearer(1.755, 85.0, "male")
FILES = ["serial-y-x-z", "nesm", "spherical-3rrr", "3rps-passive-ball", "six-cables", "spring-support"]
#: What a device may answer with where the question does not fit it: its drives are no muscles, say.
ANSWERS = (ep.InvalidInput, ep.MissingData)


def test_a_heavy_wrist_keeps_its_kinematics_on_its_wearer():
    exo = ep.load(URDF / "six-cables.urdf")
    worn, pose = exo.worn_by(MAN), exo.pose(40, 20)
    lengths = worn.inverse_kinematics(pose).lengths
    np.testing.assert_array_equal(lengths, exo.inverse_kinematics(pose).lengths)
    ends = worn.geometry.base_points - worn.geometry.platform_points @ pose.as_matrix().T
    np.testing.assert_allclose(lengths, np.linalg.norm(ends, axis=1), atol=1e-12)
    assert worn.wrist.limbs_alone().limb_count == 6
    assert worn.view() is not None


@pytest.mark.parametrize("name", FILES)
def test_what_is_listed_is_there(name):
    exo = ep.load(URDF / f"{name}.urdf").worn_by(MAN)
    listed = [attribute for attribute in dir(exo) if not attribute.startswith("_")]
    assert len(listed) > 20
    for attribute in listed:
        getattr(exo, attribute)


@pytest.mark.full
@pytest.mark.parametrize("name", FILES)
def test_every_method_answers(name, tmp_path):
    exo = ep.load(URDF / f"{name}.urdf").worn_by(MAN)
    pose = exo.pose(30, 20)
    certain = {"offset_mm": 0.0, "joint_mm": 0.0, "end_b_mm": 0.0}
    known = {
        "poses": pose, "person": ep.Person(1.755, 85.0, "male"), "folder": tmp_path, "file": tmp_path / "x.urdf",
        "motion": ep.Motion([0.1, 0.2, 0.3], [1.0, 0.0, 0.0]), "lengths": np.full(6, 0.4), "theta_x": np.zeros(6),
        "movement": ep.Movement.from_samples(np.arange(4.0), exo.pose([0, 10, 20, 30], 0), smoothing=None),
    }  # fmt: skip
    asked = {"workspace": {"poses": 60.0}, "compare": {"poses": pose}, "uncertainty": {"uncertainties": certain}}
    called, refused = [], []
    for attribute in dir(exo):
        method = getattr(exo, attribute, None)
        if attribute.startswith("_") or not inspect.ismethod(method) or inspect.isclass(method.__self__):
            continue
        needed = [
            key
            for key, part in inspect.signature(method).parameters.items()
            if part.default is part.empty and part.kind not in (part.VAR_POSITIONAL, part.VAR_KEYWORD)
        ]
        words = {key: known[key] for key in needed if key in known} | asked.get(attribute, {})
        if not set(needed) <= words.keys():
            continue
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                method(*([exo] if attribute == "compare" else []), **words)
            except ANSWERS as error:
                refused.append(f"{attribute}: {error}")
        called.append(attribute)
    assert {"reaction", "workspace", "singularity", "joint_contact", "uncertainty", "view", "compare"} <= set(called)
    # Neither NotAWrist nor an attribute that is absent.
    assert not [text for text in refused if "not a wrist" in text]
