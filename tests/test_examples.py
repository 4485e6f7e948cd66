"""Examples in the docstrings of public names: they run, print what they show, and none stands twice."""

import doctest
import inspect
import runpy
from collections import Counter

import numpy as np
import pytest
import reference_pages
from places import SCRIPTS, URDF
from scenes import has_human

import exo_pin as ep

NAMES = runpy.run_path(str(SCRIPTS / "public_names.py"))
CALLABLES = NAMES["callables"]()
#: One of each function, though it stands under several classes: path and docstring.
TOLD = {
    (function := inspect.unwrap(item)).__module__ + "." + function.__qualname__: (path, item.__doc__ or "")
    for path, item in CALLABLES.items()
}
EXAMPLES = {key: each for key, each in TOLD.items() if ">>>" in each[1]}
FLAGS = doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS
#: Examples that search, simulate or compile for seconds.
SLOW = {
    "exo_pin.ClosedChain.inverse_dynamics_derivatives", "exo_pin.ClosedChain.forward_dynamics_derivatives",
    "exo_pin.chain.MotionDerivatives", "exo_pin.chain.Derivatives", "exo_pin.chain.Derivatives.joint_reaction",
    "exo_pin.ShoulderExo.reaction_map", "exo_pin.ShoulderExo.uncertainty", "exo_pin.ShoulderExo.track",
    "exo_pin.SuspectMeasurements", "exo_pin.ContactRange", "exo_pin.Person.contact_range",
    "exo_pin.optimise", "exo_pin.workspace.recheck",
    "exo_pin.Plant", "exo_pin.ShoulderExo.joint_contact", "exo_pin.experiment",
    "exo_pin.ShoulderExo.contact_range", "exo_pin.ShoulderExo.joint_contact_of_run",
    "exo_pin.Tracking.plot", "exo_pin.thesis.ledger", "exo_pin.view.Scene.save_png",
    "exo_pin.muscle.DynamicIdentification", "exo_pin.muscle.identify_dynamic", "exo_pin.muscle.Recording.residual",
    *(f"exo_pin.report.{name}" for name in ("Posture", "Task", "PersonFit", "Hazard", "DesignReport", "DriveNeed")),
    "exo_pin.ShoulderExo.report", "exo_pin.report.DesignReport.save",
    "exo_pin.muscle.settling_against_lag", "exo_pin.muscle.StepResponse", "exo_pin.muscle.StepResponse.settling_time",
}  # fmt: skip


def run(path, text):
    """Run an example where ``ep`` and ``np`` are imported, and give what differs."""
    test = doctest.DocTestParser().get_doctest(text, {"ep": ep, "np": np}, path, None, None)
    told = []
    doctest.DocTestRunner(optionflags=FLAGS).run(test, out=told.append)
    return "".join(told)


@pytest.mark.parametrize(
    ("path", "text"),
    [pytest.param(*each, id=each[0], marks=[pytest.mark.full] * (each[0] in SLOW)) for each in EXAMPLES.values()],
)
def test_an_example_prints_what_it_shows(path, text, monkeypatch, tmp_path):
    if "Person(" in text or "joint_contact" in text:
        pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    if "human_urdf()" in text and not has_human():
        pytest.skip("example-robot-data is not installed")
    if "import crocoddyl" in text:
        pytest.importorskip("crocoddyl", reason="crocoddyl is not installed")
    if '"urdf/' in text:
        (tmp_path / "urdf").symlink_to(URDF)
    monkeypatch.chdir(tmp_path)
    assert run(path, text) == ""


def test_the_reference_has_every_room_with_public_names():
    rooms = {path.parent.name for path in NAMES["PACKAGE"].glob("*/__init__.pyi")}
    assert rooms - set(NAMES["ROOMS"]) == {"numerics"}  # which is not for scripts
    tasks = [room for group in reference_pages.TASKS.values() for room in group]
    assert sorted(tasks) == sorted(NAMES["ROOMS"])
    assert set(reference_pages.MOST_USED) <= set(CALLABLES)
    assert len(reference_pages.MOST_USED) == 10


def test_each_public_name_stands_in_a_page_a_notebook_or_a_command():
    assert NAMES["without_place"]() == []


def test_a_wrong_example_is_reported():
    assert "Expected" in run("wrong", ">>> 1 + 1\n3\n")


def test_public_names_have_examples():
    assert sorted(path for key, (path, _) in TOLD.items() if key not in EXAMPLES) == []
    assert len(EXAMPLES) > 600
    # What most scripts call has one.
    used = {f"exo_pin.ShoulderExo.{name}" for name in ("reaction", "follow", "inverse_kinematics", "workspace")}
    used |= {f"exo_pin.{name}" for name in ("solve", "Case", "Assumptions", "Load", "Motion", "Wearer", "sweep", "Arm")}
    assert used <= {path for path, _ in EXAMPLES.values()}


def test_no_two_examples_are_the_same():
    parser = doctest.DocTestParser()
    sources = ["".join(each.source for each in parser.get_examples(text)) for _, text in EXAMPLES.values()]
    assert [source for source, count in Counter(sources).items() if count > 1] == []
    for source in sources:
        assert source.strip()


def test_public_functions_say_what_they_take_and_return():
    unsaid = set()
    for key, item in {key: CALLABLES[path] for key, (path, _) in TOLD.items()}.items():
        if inspect.isclass(item):
            continue
        text, called = inspect.getdoc(item) or "", inspect.signature(inspect.unwrap(item))
        # The chain is the first argument of the functions behind its methods.
        taken = [name for name in called.parameters if name not in ("self", "cls", "state")]
        gives = called.return_annotation not in ("None", None, inspect.Signature.empty)
        if (taken and "Parameters\n---" not in text) or (gives and "Returns\n---" not in text):
            unsaid.add(key)
    assert sorted(unsaid) == []
