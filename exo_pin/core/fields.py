"""Fields of frozen records, checked and stored when the record is made, in its ``__post_init__``."""

from __future__ import annotations

from typing import Any

from .validation import as_positive, require_type


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
