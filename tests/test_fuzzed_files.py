"""Files of every format with random damage: each is read, or refused by a typed error, and none hangs.

Hypothesis makes the damage from a fixed seed: a short sample here, thousands of files for each format with ``-m full``.
"""

import contextlib
import functools
import signal
import warnings

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from places import URDF

import exo_pin as ep
from exo_pin import muscle
from exo_pin.chain import read_closures
from exo_pin.control import read_run
from exo_pin.core.errors.base import LONGEST
from exo_pin.device.files.device_files import read_design, read_device

EXAMPLES = URDF.parent / "examples"
#: A file of these takes milliseconds, or a second where MuJoCo reads it; one that takes this long, s, hangs.
HANGS = 120
#: What damages a file of numbers, names and brackets.
TOKENS = (
    *("", "nan", "inf", "-1", "0", "1e400", "-1e-400", "9" * 400, "1_000", "true", "x", " ", "\n", "\r", "\t", "\0"),
    *("\x1b[2J", "\udcff", "\ufeff", "é", ",", ";", '"', "'", "=", "[", "]", "[[", "{", "}", "<", ">", "</", "/>", "&"),
    *("&lt;", "<!--", "#", ".", "..", "../", "..\n", "[a]\n", "joint", "mass", "time_s", "left"),
)

edits = st.lists(
    st.tuples(
        st.sampled_from(["insert", "replace", "cut", "repeat", "swap"]),
        st.floats(0.0, 1.0, exclude_max=True),
        st.integers(1, 60),
        st.one_of(st.sampled_from(TOKENS), st.floats().map(repr), st.integers().map(str), st.text(max_size=8)),
    ),
    min_size=1,
    max_size=4,
)


def damaged(text, changes):
    for kind, place, length, token in changes:
        start = int(place * len(text))
        part = text[start : start + length]
        if kind == "insert":
            text = text[:start] + token + text[start:]
        elif kind == "replace":
            text = text[:start] + token + text[start + length :]
        elif kind == "cut":
            text = text[:start] + text[start + length :]
        elif kind == "repeat":
            text = text[:start] + 3 * part + text[start:]
        else:
            text = text[:start] + part[::-1] + text[start + length :]
    return text


def robot(path):
    return ep.ClosedChain.from_urdf(path, URDF / "spherical-3rrr.closures.toml")


@functools.cache
def strut():
    return ep.ClosedChain.from_urdf(URDF / "spring-support.urdf", URDF / "spring-support.closures.toml")


def device_file(path):
    return read_device(path, strut(), "left")


def movement(path):
    return ep.read_movement(path).poses.as_quat()


def rest(path):
    return muscle.read_measurements(path, 0.3).force


#: Format, its ending, and its reader, which returns arrays where all that is read are numbers.
FORMATS = {
    "design": (".toml", read_design),
    "urdf": (".urdf", robot),
    "closures": (".toml", read_closures),
    "device": (".toml", device_file),
    "mjcf": (".xml", ep.ClosedChain.from_mjcf),
    "sdf": (".sdf", ep.ClosedChain.from_sdf),
    "static muscle": (".toml", muscle.load_parameters),
    "dynamic muscle": (".toml", muscle.load_dynamic),
    "movement": (".csv", movement),
    "run": (".csv", lambda path: read_run(path).lengths),
    "response": (".csv", rest),
}


@pytest.fixture(scope="module")
def texts(tmp_path_factory):
    """A good file of each format."""
    folder = tmp_path_factory.mktemp("good")
    chain = robot(URDF / "spherical-3rrr.urdf")
    muscle.save_parameters(muscle.muscle_model("best"), folder / "static.toml")
    muscle.save_dynamic(muscle.dynamic_model("tang-3-31"), folder / "dynamic.toml")
    paths = {
        "design": EXAMPLES / "device.toml",
        "urdf": URDF / "spherical-3rrr.urdf",
        "closures": URDF / "prototype.closures.toml",
        "device": URDF / "spring-support.device.toml",
        "mjcf": chain.to_mjcf(folder),
        "sdf": chain.to_sdf(folder),
        "static muscle": folder / "static.toml",
        "dynamic muscle": folder / "dynamic.toml",
        "movement": EXAMPLES / "lift.csv",
        "run": EXAMPLES / "measured.csv",
        "response": EXAMPLES / "muscle.csv",
    }
    return {name: path.read_text(encoding="utf-8") for name, path in paths.items()}


@contextlib.contextmanager
def alarm(seconds):
    def ring(*_):
        raise TimeoutError(f"reading took more than {seconds} s")

    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


@pytest.mark.parametrize(
    "count", [12, pytest.param(400, marks=pytest.mark.full), pytest.param(2_000, marks=pytest.mark.long)]
)
@pytest.mark.parametrize("name", FORMATS)
def test_damaged_files_are_read_or_refused(name, count, texts, tmp_path):
    ending, read = FORMATS[name]
    path = tmp_path / f"damaged{ending}"
    path.write_text(texts[name], encoding="utf-8")
    read(path)  # the good one

    @settings(
        max_examples=count, derandomize=True, deadline=None, database=None, suppress_health_check=list(HealthCheck)
    )
    @given(changes=edits)
    def check(changes):
        path.write_bytes(damaged(texts[name], changes).encode("utf-8", "surrogatepass"))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                with alarm(HANGS):
                    answer = read(path)
            except ep.ExoPinError as error:
                answer = str(error)
        assert not isinstance(answer, str) or len(answer) <= LONGEST
        assert not isinstance(answer, np.ndarray) or np.isfinite(answer).all()

    check()


def test_damage_is_what_it_says():
    text = "0123456789"
    assert damaged(text, [("insert", 0.5, 2, "x")]) == "01234x56789"
    assert damaged(text, [("replace", 0.5, 2, "x")]) == "01234x789"
    assert damaged(text, [("cut", 0.0, 3, ""), ("swap", 0.0, 2, "")]) == "4356789"
    assert damaged(text, [("repeat", 0.9, 5, "")]) == "0123456789999"
