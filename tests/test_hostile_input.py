"""Thousands of malformed calls: each raises a typed error or marks its rows; none hangs, none warns.

Those of the second kind are good calls of every public name, recorded while questions of every kind are answered
(``tests/oracles/harvest.py``), with one argument replaced by a value that hardly any argument can be.
"""

import contextlib
import inspect
import signal
import warnings

import numpy as np
import pytest
from harvest import EXAMPLES, NUMERICAL, OTHER
from hostile_calls import HOSTILE, Call, Recorder, public_callables
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from malformed_calls import MAKERS
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import InvalidInput, numerics, reaction, study, thesis
from exo_pin.core import compiled
from exo_pin.core.errors.base import LONGEST
from exo_pin.load_case import Movement
from exo_pin.reaction import Reaction
from exo_pin.reaction.answer import BEYOND
from exo_pin.study import StudyTable

#: A call of this test takes milliseconds, or a minute of a busy machine where it compiles; one that takes this long, s,
#: hangs.
HANGS = 120


def check_answer(answer):
    """What came back is finite wherever it claims to be an answer, and marked wherever it is not."""
    if isinstance(answer, Reaction):
        held = answer.has_answer
        for name in ("shoulder_force", "actuator_forces", "constraint_forces", "limb_wrenches"):
            values = getattr(answer, name)
            assert np.isfinite(values[held]).all(), name
            assert np.isnan(values[~held]).all(), name
        if (answer.status == "infeasible").any():
            bad = answer.infeasibility.infeasible
            assert bad[answer.status == "infeasible"].all()
            # Evidence leaves strokes out: a pose out of stroke can lack forces besides.
            assert np.isin(answer.status[bad], BEYOND).all()
            assert (answer.infeasibility.required[bad] > answer.infeasibility.available[bad]).all()
    elif isinstance(answer, Movement):
        assert np.isfinite(answer.motion.angular_acceleration).all()
    elif isinstance(answer, StudyTable):
        figures = answer["holdable"]
        np.testing.assert_array_equal(np.isnan(figures), answer["error"] != "")
    elif isinstance(answer, Rotation):
        assert np.isfinite(answer.as_quat()).all()


@contextlib.contextmanager
def alarm(seconds):
    def ring(*_):
        raise TimeoutError(f"a call took more than {seconds} s")

    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


@pytest.mark.parametrize("calls", [4_000, pytest.param(20_000, marks=pytest.mark.full)])
@pytest.mark.parametrize("maker", MAKERS, ids=lambda maker: maker.__name__)
def test_malformed_calls_raise_typed_errors_or_mark_their_rows(maker, calls):
    rng = np.random.default_rng(90 + MAKERS.index(maker))
    count = -(-calls // len(MAKERS))
    refused = 0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # Random poses are no poses of people.
        warnings.simplefilter("ignore", ep.OutsideHumanRange)
        for call in range(count):
            try:
                with alarm(HANGS):
                    check_answer(maker(rng))
            except ep.ExoPinError:
                refused += 1
            except Exception as error:
                raise AssertionError(f"call {call} of {maker.__name__}: {type(error).__name__}: {error}") from error
    assert refused > 0.1 * count


#: What solvers call many times checks nothing, and what keeps what it was given would spoil later calls.
UNCHECKED = {
    "ConstantFriction.bound",
    "ConstantFriction.factors",
    "ConstantFriction.printed",
    "DynamicModel.margins",
    "Damping.printed",
    "Damping.rate",
    "ImuSensor.read",
    "LoadDependentFriction.bound",
    "LoadDependentFriction.factors",
    "LoadDependentFriction.printed",
    "PolynomialModel.unchecked_force",
}


#: A grid of 3° is a question, of a device one of minutes.
GOOD = {("workspace", "poses", "three"), ("ShoulderExo.workspace", "poses", "three")}


def hostile_calls(recorded):
    """Name, good call, argument and kind of hostile value of every combination."""
    for name in sorted(recorded):
        for call in recorded[name][:1]:
            for argument in call.arguments:
                # Solvers make records of what they have computed by made_of, which checks nothing either.
                if argument != "self" and name not in UNCHECKED and not name.endswith(".made_of"):
                    yield from ((name, call, argument, kind) for kind in HOSTILE if (name, argument, kind) not in GOOD)


def without_examples(recorded):
    """Good calls of what no question calls: all arguments None, but for the one that is replaced."""
    for name, thing in public_callables().items():
        bound = "." not in name or inspect.ismethod(thing)
        if bound and name not in recorded and not inspect.isabstract(thing):
            recorded[name] = [Call(name, thing, dict.fromkeys(inspect.signature(thing).parameters))]


def arrays_of(values):
    return [value.copy() for value in values if isinstance(value, np.ndarray) and value.dtype != object]


def ask(call, argument, value):
    """One call; what is wrong with it, or an empty text."""
    before = arrays_of(call.arguments.values())
    try:
        with alarm(HANGS):
            answer = call(**{argument: value})
            # A record is what it is made of.
            if not inspect.isclass(call.function):
                check_answer(answer)
        if isinstance(answer, float | np.floating) and np.isnan(answer):
            return "answers NaN"
    except ep.ExoPinError as error:
        if len(str(error)) > LONGEST:
            return f"{len(str(error))} characters"
    except Exception as error:
        # Python's own word for a name that the function does not have, in place of its further ones.
        return "" if "unexpected keyword argument 'unknown'" in str(error) else f"{type(error).__name__}: {error}"
    after = arrays_of(call.arguments.values())
    same = all(one.tobytes() == other.tobytes() for one, other in zip(before, after, strict=True))
    return "" if same else "has changed an argument"


@pytest.fixture
def recorded(tmp_path, monkeypatch, request):
    """Good calls by name; all kinds of questions for the long run, forces and kinematics for the short one."""
    monkeypatch.chdir(tmp_path)
    with compiled.mode("compiled"), Recorder() as recorder:
        for scenario in (*NUMERICAL, *OTHER) if request.param == "all" else (NUMERICAL[0], NUMERICAL[2]):
            scenario(tmp_path)
        for make in EXAMPLES if request.param == "all" else ():
            make()
    found = {name: calls for name, calls in recorder.calls.items() if calls}
    if request.param == "all":
        without_examples(found)
    return found


@pytest.mark.parametrize(
    ("recorded", "count"),
    [
        ("some", 400),
        pytest.param("all", 2_000, marks=pytest.mark.full),
        pytest.param("all", 20_000, marks=pytest.mark.long),
    ],
    indirect=["recorded"],
)
def test_hostile_arguments_end_as_typed_errors_or_valid_answers(recorded, count):
    calls = list(hostile_calls(recorded))
    rng = np.random.default_rng(33)
    wrong = {}
    with warnings.catch_warnings():
        # Some hostile values are suspicious numbers, or kinds of objects that NumPy warns of.
        warnings.simplefilter("ignore")
        for index in rng.permutation(len(calls))[:count]:
            name, call, argument, kind = calls[index]
            if found := ask(call, argument, HOSTILE[kind]()):
                wrong[f"{name}({argument}={kind})"] = found[:200]
    assert not wrong, "\n".join(f"{call}: {what}" for call, what in sorted(wrong.items()))


#: Values of every kind that Python and NumPy have, drawn anew for each call.
NUMBERS = st.one_of(st.integers(), st.floats(), st.booleans(), st.complex_numbers())
LEAVES = st.one_of(st.none(), NUMBERS, st.text(max_size=20), st.binary(max_size=8), st.dates(), st.decimals())
ARRAYS = arrays(
    st.sampled_from([float, int, bool, complex, "U3", np.float32, np.int8]),
    array_shapes(min_dims=0, max_dims=4, min_side=0, max_side=4),
)
VALUES = st.one_of(
    ARRAYS,
    st.recursive(
        LEAVES,
        lambda inner: st.one_of(
            st.lists(inner, max_size=4),
            st.tuples(inner, inner),
            st.dictionaries(st.text(max_size=8), inner, max_size=3),
            st.sets(st.text(max_size=4), max_size=3),
        ),
        max_leaves=12,
    ),
)


@pytest.mark.parametrize(
    ("recorded", "count"),
    [
        ("some", 200),
        pytest.param("all", 1_500, marks=pytest.mark.full),
        pytest.param("all", 10_000, marks=pytest.mark.long),
    ],
    indirect=["recorded"],
)
def test_drawn_arguments_end_as_typed_errors_or_valid_answers(recorded, count):
    calls = list(dict.fromkeys((name, argument) for name, _, argument, _ in hostile_calls(recorded)))
    wrong = {}

    @settings(
        max_examples=count, derandomize=True, deadline=None, database=None, suppress_health_check=list(HealthCheck)
    )
    @given(st.integers(0, len(calls) - 1), VALUES)
    def check(index, value):
        name, argument = calls[index]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            if found := ask(recorded[name][0], argument, value):
                wrong[f"{name}({argument}={value!r:.200})"] = found[:200]

    check()
    assert not wrong, "\n".join(f"{call}: {what}" for call, what in sorted(wrong.items()))


def test_names_that_two_rooms_have_are_two_names():
    """And what does not fit a program is told by the argument's name."""
    found = public_callables()
    assert {id(study.compare), id(thesis.compare), id(reaction.solve), id(numerics.solve)} <= set(
        map(id, found.values())
    )
    with pytest.raises(InvalidInput, match="program"):
        numerics.solve("x")
    with pytest.raises(InvalidInput, match="expected lower to be real numbers"):
        numerics.least_force(np.ones(3), np.eye(3), np.zeros(3) * 1j, np.ones(3))
    with pytest.raises(InvalidInput, match="expected effects to be real numbers"):
        numerics.least_forces(np.ones((1, 3)), np.eye(3)[None] * 1j, np.zeros((1, 3)), np.ones((1, 3)))


def test_a_call_that_is_wrong_is_found():
    def broken(values, flag):
        values[0] += flag
        return values.nothing

    call = Call("broken", broken, {"values": np.zeros(2), "flag": 1.0})
    assert ask(call, "flag", 3).startswith("AttributeError")
    assert ask(Call("tidy", lambda values: float("nan"), {"values": 1.0}), "values", 3) == "answers NaN"

    def spoils(values, flag):
        values[0] = flag

    call = Call("spoils", spoils, {"values": np.zeros(2), "flag": 1.0})
    assert ask(call, "flag", 3) == "has changed an argument"


@pytest.mark.parametrize("name", ["prototype", "urdf/nesm.urdf", "urdf/spring-support.urdf"])
def test_a_stack_without_poses_has_answers(name):
    exo, none = ep.load(name), Rotation.from_quat(np.zeros((0, 4)))
    answer = exo.reaction(none)
    assert answer.shoulder_force.shape == (0, 3)
    assert "of 0 poses" in str(answer)
    assert str(exo.accuracy(none)) == "How well the drives place the arm is not known here."
