"""Parameters of a sweep and the designs with their values."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from ..core.errors import InvalidInput, UnknownName
from ..core.errors.base import echo
from ..core.validation import FloatArray, as_finite, as_positive
from ..design import Arm, Limb

if TYPE_CHECKING:
    from ..exo.shoulder_exo import ShoulderExo

__all__ = ["PARAMETERS", "changed", "labelled", "parameter_values"]


def parameter_values(parameters: Mapping[str, Any]) -> dict[str, list[Any]]:
    """Check the values of a sweep, by name.

    Raises
    ------
    UnknownName
        If a name is none of :data:`PARAMETERS`.
    InvalidInput
        If there are no values.
    """
    if not isinstance(parameters, Mapping) or not parameters:
        raise InvalidInput("expected parameters to map names to sequences of values")
    out: dict[str, list[Any]] = {}
    for name, given in parameters.items():
        if not isinstance(name, str) or base_name(name) not in PARAMETERS:
            raise UnknownName("parameter", name, PARAMETERS)
        listed = list(given) if np.iterable(given) and not isinstance(given, str) else []
        if not listed:
            raise InvalidInput(f"expected a sequence of values of {name}, got {echo(given)}")
        out[name] = listed
    return out


def base_name(name: str) -> str:
    head, bracket, tail = name.partition("[")
    return head if bracket and tail.endswith("]") and tail[:-1].isdigit() and head.startswith("alpha") else name


def labelled(name: str, value: Any) -> dict[str, Any]:
    """Columns that show a value in the table: one for a number or name, one a component for an array."""
    if isinstance(value, Arm):
        return {name: value.mass}
    if isinstance(value, str):
        return {name: value}
    if name == "limbs" and isinstance(value, Sequence):
        return {name: "+".join(str(getattr(limb, "kind", "?")) for limb in value)}
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        return {name: echo(value)}
    if array.ndim == 0:
        return {name: float(array)}
    return {f"{name}_{k + 1}": part for k, part in enumerate(array.ravel().tolist())}


def _circle(exo: ShoulderExo, name: str, value: Any) -> ShoulderExo:
    head, circles = base_name(name), exo.geometry.circles
    if circles is None:
        raise InvalidInput(f"{name} needs joints on circles")
    if not head.startswith("alpha"):
        return exo.replace(geometry=exo.geometry.replace(**{head: value}))
    # Both are given, because the geometry would change alpha_B with alpha_A where they are equal.
    halves = {half: getattr(circles, half) for half in ("alpha_A", "alpha_B")}
    for half in halves if head == "alpha" else (head,):
        halves[half] = value if head == name else _one_angle(name, halves[half], value)
    return exo.replace(geometry=exo.geometry.replace(**halves))


def _one_angle(name: str, angles: FloatArray, value: Any) -> FloatArray:
    changed, index = np.array(angles), int(name.partition("[")[2][:-1]) - 1
    if not 0 <= index < len(changed):
        raise InvalidInput(f"expected limb 1 to {len(changed)}, got {name}")
    changed[index] = as_finite(name, value, ())
    return changed


def _lean(exo: ShoulderExo, axis: str, angle: Any) -> ShoulderExo:
    turn = Rotation.from_euler(axis, float(as_finite("lean", angle, ())))
    return exo.replace(gravity=turn.inv().apply(np.array(exo.mechanism.gravity)))


def _loaded(exo: ShoulderExo, mass: Any, hand: FloatArray | None) -> ShoulderExo:
    assert hand is not None
    kilograms = as_positive("payload", mass, zero=True)
    if kilograms == 0.0:
        return exo
    return exo.replace(arm=exo.mechanism.require_arm("a payload") + Arm(kilograms, hand, np.zeros((3, 3))))


def changed(exo: ShoulderExo, name: str, value: Any, hand: FloatArray | None) -> ShoulderExo:
    """The design with one parameter changed; ``hand`` is where a payload is held, shape (3,), m."""
    return PARAMETERS[base_name(name)](exo, name, value, hand)


_Change = Callable[["ShoulderExo", str, Any, "FloatArray | None"], "ShoulderExo"]

#: What :func:`sweep` can vary.
PARAMETERS: dict[str, _Change] = {
    **dict.fromkeys(
        ("r_A", "r_B", "h_A", "h_B", "alpha", "alpha_A", "alpha_B"),
        lambda exo, name, value, _: _circle(exo, name, value),
    ),
    **dict.fromkeys(("arm", "limbs", "gravity"), lambda exo, name, value, _: exo.replace(**{name: value})),
    "person": lambda exo, _, value, __: exo.worn_by(value),
    "payload": lambda exo, _, value, hand: _loaded(exo, value, hand),
    "limb_kind": lambda exo, _, value, __: exo.replace(limbs=(Limb(value),) * exo.geometry.limb_count),
    "lean_forward": lambda exo, _, value, __: _lean(exo, "y", value),
    "lean_left": lambda exo, _, value, __: _lean(exo, "x", -np.asarray(value)),
}
