"""The ledger: numbers of the thesis, numbers of exo_pin, and the verdict.

Numbers of exo_pin are computed on demand; printed numbers stand in ``printed_rows.toml`` as printed.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from ..core.errors.checked import checked
from ..core.records import Record
from ..core.validation import FloatArray, frozen

Verdict = Literal[
    "reproduced",
    "misprint, corrected",
    "reproduced under another reading",
    "contradicted",
    "input not printed",
    "not reproducible",
]
#: All verdicts, the best first.
VERDICTS: tuple[Verdict, ...] = get_args(Verdict)
NOT_REPRODUCIBLE: Verdict = "not reproducible"
OTHER_READING: Verdict = "reproduced under another reading"
INPUT_NOT_PRINTED: Verdict = "input not printed"
Relation = Literal["equal", "at most", "within"]
#: What the note of a row says whose print is a bound.
_BOUNDS = {"equal": "", "at most": "the text states a bound", "within": "the text states two bounds"}
#: Ends the note of a row that was searched for another reading in vain, as docs/evidence/thesis.md lists.
NO_READING = "; no other reading found"


@dataclass(frozen=True, eq=False)
class Row(Record):
    """One published result.

    Attributes
    ----------
    source : str
        Table, equation or section of the thesis.
    quantity : str
        What it is.
    unit : str
        Of both numbers.
    printed, computed : ndarray
        Of the same shape, in ``unit``.
    verdict : str
        "reproduced": equal to within the rounding of the print. "misprint, corrected": not so, but equal once a
        named slip of the print is mended. "reproduced under another reading": it follows from the printed data when
        they are read in another way than the text says; ``computed`` is what the text says. "contradicted": all that
        it follows from is printed elsewhere in the thesis, and gives another number. "input not printed": it depends
        on data that the thesis does not print, so nothing is said for or against it. "not reproducible": no reading of
        the print that was tried gives it.
    note : str
        What the verdict rests on: what was mended, assumed or left out.
    digits : int
        Decimals to show.
    reading : str
        Name of the other reading, if it is that which reproduces the print.

    Examples
    --------
    >>> from exo_pin.thesis import Row
    >>> row = Row("Table 1", "length", "m", np.array(0.350), np.array(0.357), "contradicted", "the sum of its parts")
    >>> round(float(row.computed - row.printed), 3)  # m
    0.007
    """

    source: str
    quantity: str
    unit: str
    printed: FloatArray
    computed: FloatArray
    verdict: Verdict
    note: str = ""
    digits: int = 4
    reading: str = ""


@checked
def compare(
    source: str,
    quantity: str,
    unit: str,
    printed: ArrayLike,
    computed: ArrayLike,
    rounding: ArrayLike,
    mended: ArrayLike | None = None,
    note: str = "",
    digits: int = 4,
    reading: tuple[str, ArrayLike] | None = None,
    verdict: Verdict | None = None,
    otherwise: Verdict = NOT_REPRODUCIBLE,
    relation: Relation = "equal",
) -> Row:
    """Make a row, with the verdict drawn from the numbers.

    Parameters
    ----------
    source, quantity, unit, note : str
        As in :class:`Row`.
    printed, computed : array_like
        The two results, same shape.
    rounding : array_like
        Largest difference that the rounding of the print, and of the printed inputs, explains; one, or one a number.
    mended : array_like, optional
        The print with its slip put right.
    digits : int
        Decimals to show.
    reading : (str, array_like), optional
        Name and result of another reading of the text.
    verdict : str, optional
        That of a row whose numbers do not decide it.
    otherwise : str
        Verdict if nothing agrees: "contradicted" where all inputs are printed.
    relation : {"equal", "at most", "within"}
        What the text says of its number: a value; a bound that no computed number exceeds; or two bounds that the
        computed numbers, the least and the greatest, lie between.

    Returns
    -------
    Row
        "reproduced" if ``printed`` agrees, "misprint, corrected" if only ``mended`` does, "reproduced under another
        reading" if only the result of ``reading`` is what is printed, else ``otherwise``.

    Examples
    --------
    >>> from exo_pin.thesis import compare
    >>> row = compare("Table 1", "length", "m", 0.35, 0.5301, 0.005, mended=0.53)  # digits swapped in print
    >>> row.verdict
    'misprint, corrected'
    """
    shown, own = (frozen(np.array(value, dtype=float).ravel()) for value in (printed, computed))

    def agree(one: ArrayLike, other: ArrayLike) -> bool:
        gap = np.ravel(other) - np.ravel(one)
        if relation == "at most":
            return bool((gap <= rounding).all())
        if relation == "within":
            return bool((gap * [1, -1] >= -np.asarray(rounding)).all())
        return bool((np.abs(gap) <= rounding).all())

    name = ""
    if verdict is None:
        if agree(shown, own):
            verdict = "reproduced"
        elif mended is not None and agree(mended, own):
            verdict = "misprint, corrected"
        elif reading is not None and agree(shown, reading[1]):
            verdict, name = OTHER_READING, reading[0]
    full_note = "; ".join(part for part in (_BOUNDS[relation], note) if part)
    return Row(source, quantity, unit, shown, own, verdict or otherwise, full_note, digits, name)


@cache
def _printed() -> dict[str, dict[str, Any]]:
    content = tomllib.loads(Path(__file__).with_name("printed_rows.toml").read_text(encoding="utf-8"))
    return {f"{part}.{key}": values for part, table in content.items() for key, values in table.items()}


def printed_table(name: str) -> dict[str, FloatArray]:
    """Numbers that the thesis prints and rows are computed from: ``tables`` of ``printed_rows.toml``, by name."""
    return {part: frozen(np.array(values, dtype=float)) for part, values in _printed()[f"tables.{name}"].items()}


def row(key: str, computed: ArrayLike, values: tuple[Any, ...] = (), **own: Any) -> Row:
    """Row of the ledger: what ``printed_rows.toml`` holds under ``key`` beside a computed value.

    Parameters
    ----------
    key : str
        File and name of the row, such as "scenario_one.A_2".
    computed : array_like
        The numbers of exo_pin, in the unit of the row.
    values : tuple, optional
        What stands in the gaps of the row's note.
    **own
        Arguments of :func:`compare` that follow from a computation themselves.
    """
    held = _printed()[key]
    if values:
        own["note"] = held["note"].format(*values)
    return compare(computed=computed, **(held | own))
