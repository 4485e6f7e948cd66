"""Checks of arguments, made by every public function.

Each function returns a read-only float64 copy, so that what was checked is what is used.

Fields of frozen records, checked and stored when the record is made, in its ``__post_init__``.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import NoneType
from typing import Any, TypeVar, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from .errors import InvalidInput, UnknownName
from .errors.base import echo
from .records import Record

#: Numbers beyond this, in SI units, are no property of a device; their squares would overflow further on.
LARGEST = 1e12
#: A quantity that has to be above zero and lies below this is zero for all that follows.
SMALLEST = 1e-15

FloatArray = NDArray[np.float64]
_Scalar = TypeVar("_Scalar", bound=np.generic)


def frozen(array: NDArray[_Scalar]) -> NDArray[_Scalar]:
    """Return ``array`` with writing switched off."""
    array.setflags(False)  # type: ignore[call-arg]  # half the time of a keyword
    return array


class ReadOnly(Record):
    """For frozen records of results: arrays with writing switched off, so that an answer stays what was computed."""

    def __post_init__(self) -> None:
        for value in vars(self).values():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)


def _describe(shape: tuple[int | None, ...]) -> str:
    inner = ", ".join("n" if side is None else str(side) for side in shape)
    return f"({inner},)" if len(shape) == 1 else f"({inner})"


def as_real(name: str, value: Any) -> FloatArray:
    """Copy ``value`` as a float64 array of any shape, if it holds real numbers; they may be infinite or NaN.

    Raises
    ------
    InvalidInput
        For booleans, strings, dates, complex numbers, masked arrays and ragged lists.
    """
    try:
        if isinstance(value, np.ma.MaskedArray):
            raise TypeError
        raw = np.asarray(value)
        if raw.dtype.kind not in "iuf":
            raise TypeError
        with np.errstate(over="ignore"):
            return np.array(raw, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise InvalidInput(f"expected {name} to be real numbers, got {echo(value)}") from None


def as_finite(name: str, value: ArrayLike, shape: tuple[int | None, ...], stack: bool = False) -> FloatArray:
    """Copy ``value`` as a finite array of the given shape.

    Parameters
    ----------
    name : str
        Name of the argument, for the message.
    value : array_like
        What was passed.
    shape : tuple
        Expected shape; None means any length.
    stack : bool
        Whether leading stack dimensions are allowed before ``shape``.

    Returns
    -------
    ndarray
        Read-only float64 copy.

    Raises
    ------
    InvalidInput
        If it is not numeric, has another shape, or holds NaN or infinity.
    """
    array = as_real(name, value)
    tail = array.shape[len(array.shape) - len(shape) :] if len(array.shape) >= len(shape) else ()
    fits = len(tail) == len(shape) and all(want is None or want == got for want, got in zip(shape, tail, strict=True))
    if not fits or (not stack and len(array.shape) != len(shape)):
        want = _describe(shape)
        if stack:
            want = "(..., " + want[1:]
        raise InvalidInput(f"expected {name} to have shape {want}, got {array.shape}")
    if not np.isfinite(array).all():
        raise InvalidInput(f"expected {name} to be finite, got {echo(value)}")
    if np.abs(array).max(initial=0.0) > LARGEST:
        raise InvalidInput(f"expected {name} in SI units, at most {LARGEST:g} in size, got {np.abs(array).max():g}")
    return frozen(array)


def broadcast(**named: ArrayLike) -> tuple[FloatArray, ...]:
    """Finite arrays, named for the message, brought to one shape."""
    return broadcast_real(**{name: as_finite(name, value, (), stack=True) for name, value in named.items()})


def broadcast_real(**named: ArrayLike) -> tuple[FloatArray, ...]:
    """Arrays that may hold NaN and infinity, named for the message, brought to one shape."""
    arrays = [as_real(name, value) for name, value in named.items()]
    try:
        return tuple(np.broadcast_arrays(*arrays))
    except ValueError:
        shapes = ", ".join(str(array.shape) for array in arrays)
        raise InvalidInput(f"expected {', '.join(named)} to broadcast, got shapes {shapes}") from None


def broadcast_to(name: str, array: Any, shape: tuple[int, ...]) -> Any:
    """The array brought to a shape; InvalidInput if it does not broadcast."""
    try:
        return np.broadcast_to(array, shape)
    except ValueError:
        raise InvalidInput(f"expected {name} to broadcast to {shape}, got {array.shape}") from None


def as_mapping(name: str, value: Any, what: str) -> Mapping[Any, Any]:
    """Return ``value`` if it is a mapping, and an empty one for None.

    Raises
    ------
    InvalidInput
        If it is something else; the message says ``what`` was expected.
    """
    if value is None:
        return {}
    if not isinstance(value, Mapping):
        raise InvalidInput(f"expected {name} as a mapping of {what}, got {echo(value)}")
    return value


def as_texts(name: str, value: Any) -> tuple[str, ...]:
    """Return ``value`` if it is a tuple of strings, else raise InvalidInput."""
    if not isinstance(value, tuple) or not all(isinstance(text, str) for text in value):
        raise InvalidInput(f"expected {name} to be a tuple of strings, got {echo(value)}")
    return value


def as_parts(name: str, value: Any, kind: type) -> tuple[Any, ...]:
    """Return an iterable of instances of a class as a tuple, else raise InvalidInput; a text is not one of texts."""
    try:
        parts = (None,) if isinstance(value, str | bytes) else tuple(value)
    except TypeError:
        raise InvalidInput(f"expected {name} to be several, each {_described(kind)}, got {echo(value)}") from None
    for part in parts:
        require_type(f"each of {name}", part, kind)
    return parts


def as_choice(kind: str, value: Any, available: Iterable[str], where: str = "") -> str:
    """Return ``value`` if it is one of the names ``available``.

    Raises
    ------
    UnknownName
        If it is not, whatever its type; the message lists what there is, and names ``where`` if it is given.
    """
    names = tuple(available)
    if not isinstance(value, str) or value not in names:
        raise UnknownName(kind, value, names, where)
    return value


def as_pair(name: str, bounds: Any) -> Any:
    """The pair (-N, N) for a number N; anything else as it is.

    Raises
    ------
    InvalidInput
        If the number is negative.
    """
    if isinstance(bounds, bool | np.bool_) or not isinstance(bounds, int | float | np.integer | np.floating):
        return bounds
    number = float(as_real(name, bounds))
    if number < 0.0:
        raise InvalidInput(
            f"expected {name} as a number of zero or more for (-N, N), or (lower, upper), got {number:g} N"
        )
    return (-number, number)


def as_positive(name: str, value: Any, zero: bool = False) -> float:
    """Return ``value`` as a finite float above zero (or not below it, with ``zero``)."""
    if type(value) is float and SMALLEST <= value <= LARGEST:
        return value  # the usual case, without the detour over an array
    number = float(as_finite(name, value, ()))
    if number < 0 or (number == 0 and not zero):
        raise InvalidInput(f"expected {name} to be {'zero or more' if zero else 'above zero'}, got {number:g}")
    if 0.0 < number < SMALLEST:
        raise InvalidInput(f"expected {name} in SI units, at least {SMALLEST:g}, got {number:g}")
    return number


def as_count(name: str, value: Any, least: int = 0, most: int = 2**63 - 1) -> int:
    """Return ``value`` if it is a whole number of ``least`` to ``most``; True and False are none."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or not least <= value <= most:
        span = f"of {least} or more" if most == 2**63 - 1 else f"from {least} to {most}"
        raise InvalidInput(f"expected {name} to be a whole number {span}, got {echo(value)}")
    return int(value)


def as_rising(name: str, value: ArrayLike) -> FloatArray:
    """Two or more rising times, shape (n,), s."""
    times = as_finite(name, value, (None,))
    if len(times) < 2 or (np.diff(times) <= 0.0).any():
        raise InvalidInput(f"expected {name} to rise from sample to sample, with at least two samples")
    return times


def as_unit_vector(name: str, value: ArrayLike) -> FloatArray:
    """Return ``value``, shape (3,), scaled to length 1."""
    vector = as_finite(name, value, (3,))
    length = float(np.linalg.norm(vector))
    if length < 1e-12:
        raise InvalidInput(f"expected {name} to be a direction, got a zero vector")
    # A unit vector stays as it is, so that a file brings it back bit for bit.
    return frozen(vector.copy() if abs(length - 1.0) < 1e-15 else vector / length)


def as_rotation(name: str, value: Any) -> Rotation:
    """Return ``value`` if it is a scipy Rotation (single or a stack), else raise InvalidInput.

    Bare triples of angles are refused: without their order they have no meaning.
    """
    if not isinstance(value, Rotation):
        raise InvalidInput(
            f"expected {name} to be a scipy Rotation (exo_pin.thesis_rotation and exo_pin.shoulder_rotation "
            f"make one from angles), got {type(value).__name__}"
        )
    if not np.isfinite(value.as_quat()).all():
        raise InvalidInput(f"expected {name} to be finite")
    return value


def as_single_rotation(name: str, value: Any) -> Rotation:
    """Return ``value`` if it is a scipy Rotation that is no stack, else raise InvalidInput."""
    if as_rotation(name, value).shape != ():
        raise InvalidInput(f"expected {name} to be a single rotation, got a stack of shape {value.shape}")
    return value


def require_method(name: str, value: object, method: str, expected: str) -> None:
    """Raise InvalidInput if a value's class has no method of that name.

    For objects of rooms above, which are known here as types only.
    """
    if not hasattr(type(value), method):
        raise InvalidInput(f"expected {name} to be {expected}, got {type(value).__name__}")


def require_type(name: str, value: object, kind: Any, expected: str = "") -> None:
    """Raise InvalidInput if a value is not of a class, or of one of several, such as ``Arm | None`` or ``Callable``.

    The message says what was ``expected``; if that is left out, it names the classes.
    """
    if not isinstance(value, kind):
        expected = expected or " or ".join(_described(one) for one in get_args(kind) or (kind,))
        raise InvalidInput(f"expected {name} to be {expected}, got {type(value).__name__}")


def _described(kind: type) -> str:
    if kind is NoneType:
        return "None"
    return f"{'an' if kind.__name__[0] in 'AEIOU' else 'a'} {kind.__name__}"


def as_inertia(name: str, value: ArrayLike, asymmetry: float = 1e-6) -> FloatArray:
    """Return an inertia tensor that some body can have.

    Parameters
    ----------
    name : str
        Name of the argument, for the message.
    value : array_like
        Shape (3, 3), in kg m², about the centre of mass.
    asymmetry : float
        Largest difference between mirrored entries, relative to the largest entry, that is taken for
        rounding and averaged away. A larger one is an error.

    Returns
    -------
    ndarray
        Shape (3, 3), symmetric, read-only.

    Raises
    ------
    InvalidInput
        If it is not symmetric, has a negative principal moment, or breaks the triangle inequality
        (no principal moment exceeds the sum of the other two).
    """
    tensor = as_finite(name, value, (3, 3))
    scale = float(np.abs(tensor).max())
    if scale == 0.0:
        return tensor
    gap = float(np.abs(tensor - tensor.T).max())
    if gap > asymmetry * scale:
        raise InvalidInput(f"expected {name} to be symmetric, mirrored entries differ by {gap:.3g} kg m²")
    tensor = 0.5 * (tensor + tensor.T)
    principal = np.linalg.eigvalsh(tensor)
    slack = 1e-9 * scale
    if principal[0] < -slack:
        raise InvalidInput(
            f"expected {name} to be an inertia that a body can have: principal moment {principal[0]:.4g} kg m² "
            "is negative (products of inertia printed by CAD programs have the opposite sign)"
        )
    if principal[2] > principal[0] + principal[1] + slack:
        raise InvalidInput(
            f"expected {name} to be an inertia that a body can have: principal moments {principal} kg m² "
            "break the triangle inequality"
        )
    return frozen(tensor)


def set_fields(record: object, **values: Any) -> None:
    """Give fields of a frozen record their checked values."""
    for name, value in values.items():
        object.__setattr__(record, name, value)


def set_positive(record: object, *names: str, zero: bool = False, optional: bool = False) -> None:
    """Check fields as :func:`exo_pin.core.validation.as_positive` does and store them as floats.

    Parameters
    ----------
    record : object
        A frozen record.
    *names : str
        Its fields.
    zero : bool
        Whether zero is allowed.
    optional : bool
        Whether None is allowed, and stays.
    """
    for name in names:
        value = getattr(record, name)
        if value is not None or not optional:
            object.__setattr__(record, name, as_positive(name, value, zero))


def require_types(record: object, **kinds: Any) -> None:
    """Check that fields are of their classes, as :func:`exo_pin.core.validation.require_type` does."""
    for name, kind in kinds.items():
        require_type(name, getattr(record, name), kind)
