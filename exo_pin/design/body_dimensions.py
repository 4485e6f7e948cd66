"""Breadths, depths and girths of a person of given sex, stature and mass.

Each is ``a h^b m^c`` with stature h (m) and body mass m (kg), fitted in logarithms to the public tables of ANSUR II
(4,082 men and 1,986 women of the US Army, 2012; Gordon et al. 2014, NATICK/TR-15/007) by
``benchmarks/anthropometry.py``. Girths of upper arm and forearm are measured flexed, with tense muscles.

Assumptions: soldiers stand for all adults; children and persons heavier than about 140 kg are extrapolated.
"""

from __future__ import annotations

from typing import NamedTuple

from ..core.errors.checked import checked
from ..core.validation import as_choice, as_positive


class _Dimension(NamedTuple):
    scale: float
    height: float
    weight: float


_DIMENSIONS = {
    "male": {
        "upper arm girth": _Dimension(0.0445, -0.626, 0.549),
        "forearm girth": _Dimension(0.0672, -0.188, 0.368),
        "neck girth": _Dimension(0.1034, -0.377, 0.351),
        "head girth": _Dimension(0.3900, 0.097, 0.075),
        "chest breadth": _Dimension(0.0866, 0.017, 0.270),
        "chest depth": _Dimension(0.0241, -0.641, 0.611),
        "waist breadth": _Dimension(0.0282, -0.563, 0.622),
        "waist depth": _Dimension(0.0100, -1.122, 0.854),
        "sitting height": _Dimension(0.5702, 0.752, 0.012),
    },
    "female": {
        "upper arm girth": _Dimension(0.0308, -0.750, 0.632),
        "forearm girth": _Dimension(0.0580, -0.206, 0.384),
        "neck girth": _Dimension(0.1023, -0.232, 0.305),
        "head girth": _Dimension(0.4019, 0.137, 0.063),
        "chest breadth": _Dimension(0.0740, -0.090, 0.317),
        "chest depth": _Dimension(0.0235, -0.773, 0.648),
        "waist breadth": _Dimension(0.0279, -0.625, 0.636),
        "waist depth": _Dimension(0.0100, -1.353, 0.883),
        "sitting height": _Dimension(0.5942, 0.747, 0.000),
    },
}


@checked
def body_dimensions(height: float, mass: float, sex: str) -> dict[str, float]:
    """Mean breadths, depths and girths of persons of a size.

    Parameters
    ----------
    height, mass : float
        Stature, m, and body mass, kg.
    sex : {"male", "female"}
        Whose table.

    Returns
    -------
    dict of str to float
        m, by name: girths of upper arm, forearm, neck and head, breadths and depths of chest and waist,
        sitting height.

    Raises
    ------
    InvalidInput
        If a size is not above zero, or the sex is none of the two.

    Examples
    --------
    >>> from exo_pin.design.body_dimensions import body_dimensions
    >>> round(1e3 * body_dimensions(1.755, 85, "male")["upper arm girth"])  # mm; the median of ANSUR II's men is 357
    359
    """
    height, mass = as_positive("height", height), as_positive("mass", mass)
    as_choice("sex", sex, _DIMENSIONS)
    return {name: each.scale * height**each.height * mass**each.weight for name, each in _DIMENSIONS[sex].items()}
