"""What an error's message shows of its input: never more than 2,000 characters, never a control character."""

import pickle
import warnings

import numpy as np
import pytest

import exo_pin as ep
from exo_pin import ExoPinError, FileFormatError, UnknownName, muscle
from exo_pin.core import errors

Q = np.zeros(2)
#: Errors that echo a text in each of their arguments.
MAKERS = {
    "InvalidInput": lambda text: errors.InvalidInput(f"expected a number, got {text}: type one"),
    "UnknownName": lambda text: UnknownName("preset", text, [text, text + "s"], text),
    "unknown among many": lambda text: UnknownName("preset", "x", [f"{text[:60]}{k}" for k in range(3000)]),
    "FileFormatError": lambda text: FileFormatError(f"expected a number, got {text}", text, text),
    "error in an error": lambda text: FileFormatError(str(UnknownName("key", text, [text])), text),
    "FileNotWritten": lambda text: errors.FileNotWritten(text, OSError(28, text)),
    "MissingData": lambda text: errors.MissingData([text] * 50, text, text, text),
    "MissingExtra": lambda text: errors.MissingExtra("plot", text),
    "AbsentAttribute": lambda text: errors.AbsentAttribute(text, text),
    "NotAWrist": lambda text: errors.NotAWrist(text, text),
    "BeyondLimits": lambda text: errors.BeyondLimits(Q, [text] * 50),
    "UndrivenMotion": lambda text: errors.UndrivenMotion(Q, Q, [text] * 50),
    "InfeasibleForces": lambda text: errors.InfeasibleForces(1.0, [text] * 50),
    "UnsupportedDynamics": lambda text: errors.UnsupportedDynamics(text, [text] * 50, text),
    "StorageUnusable": lambda text: errors.StorageUnusable(text, text),
    "SimulationStopped": lambda text: errors.SimulationStopped(0.1, Q, Q, text),
    "SolverFailed": lambda text: errors.SolverFailed(text, 1.0, text),
    "BrowserFailed": lambda text: errors.BrowserFailed(text, text),
    "BrowserNotFound": lambda text: errors.BrowserNotFound([text] * 50, text),
    "OutsideValidity": lambda text: muscle.OutsideValidity(text, text),
    "OutsideRangeOfMotion": lambda text: errors.OutsideRangeOfMotion(text),
    "NotIdentifiable": lambda text: muscle.NotIdentifiable(text, (text,)),
    "a warning": errors.NoisyMovement,
}
TEXTS = {
    "long": "x" * 100_000,
    "long words": "many words " * 1000,
    "a terminal's escapes": "\x1b[2J\x1b]0;title\x07\x9b31m\x7f\x08" * 200,
    "turned writing": "\u202egpj.exe\u2066\u2028" * 200,
    "what no encoding has": "\ud800\udfff" * 200,
    "every character": "".join(map(chr, range(0x3000))),
}


@pytest.mark.parametrize("text", TEXTS)
@pytest.mark.parametrize("maker", MAKERS)
def test_messages_are_short_and_printable(maker, text):
    error = MAKERS[maker](TEXTS[text])
    message = str(error)
    assert 20 < len(message) <= 2000
    assert all(c.isprintable() or c == "\n" for c in message)
    message.encode()
    again = pickle.loads(pickle.dumps(error))
    assert str(again) == message
    assert vars(again).keys() == vars(error).keys()


def test_values_that_python_cannot_print():
    nested = []
    for _ in range(100_000):
        nested = [nested]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for value in (10**5000, -(10**400), nested, [10**5000], {"a": 10**5000}):
            for call in (
                lambda value=value: ep.WristGeometry(value, value),
                lambda value=value: ep.Load(value),
                lambda value=value: ep.load(value),
                lambda value=value: ep.shoulder_rotation(value, 0, 0),
                lambda value=value: ep.load("prototype").reaction(ep.load("prototype").pose(), split=value),
            ):
                with pytest.raises(ExoPinError) as caught:
                    call()
                assert len(str(caught.value)) <= 2000
