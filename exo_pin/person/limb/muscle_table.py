"""Properties of the muscles of the shoulder, elbow and forearm.

Source: the MoBL-ARMS Dynamic Upper Limb model of K. R. Saul et al., "Benchmarking of dynamic simulation predictions in
two software platforms using an upper limb musculoskeletal model", Comput. Methods Biomech. Biomed. Eng. 18 (2015) 1445,
as written in its OpenSim 4.1 file: an adult man of median size.

The muscle paths come from MyoArm (:mod:`exo_pin.person.limb.myoarm`), which is derived from the same model. MyoArm's
own strengths and fibre lengths are not used, because they are fitted to a simpler muscle model and differ from the
source:

* INFSP, TMIN and TMAJ have twice the strength of the source (2150.7, 539.0 and 288.0 N: the limit of the fit);
* LAT2 has 1.69 times the strength, the other muscles 0.76 to 1.15 times;
* the active force of SUPSP has the numbers of SUP, another muscle;
* the stored lengths of LAT1 lie beyond all lengths of its path, so that it has no active force in any pose.

With the numbers below on MyoArm's paths the fibres of all shoulder muscles stay between 0.48 and 1.65 of their
optimal length over the range of motion.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...core.validation import FloatArray

__all__ = ["MUSCLES", "MuscleTable", "muscle_table"]

#: Name: peak isometric force, N; optimal fibre length, mm; slack length of the tendon, mm; pennation, degrees.
_ROWS = {
    "DELT1": (1218.9, 97.6, 93.0, 22.0),
    "DELT2": (1103.5, 107.8, 109.5, 15.0),
    "DELT3": (201.6, 136.7, 38.0, 18.0),
    "SUPSP": (499.2, 68.2, 39.5, 7.0),
    "INFSP": (1075.8, 75.5, 30.8, 19.0),
    "SUBSC": (1306.9, 87.3, 33.0, 20.0),
    "TMIN": (269.5, 74.1, 71.3, 24.0),
    "TMAJ": (144.0, 162.4, 20.0, 16.0),
    "PECM1": (444.3, 144.2, 2.8, 17.0),
    "PECM2": (658.3, 138.5, 89.0, 26.0),
    "PECM3": (498.1, 138.5, 132.0, 25.0),
    "LAT1": (290.5, 254.0, 120.0, 25.0),
    "LAT2": (317.5, 232.4, 176.5, 19.0),
    "LAT3": (189.0, 278.9, 140.3, 21.0),
    "CORB": (208.2, 93.2, 97.0, 27.0),
    "TRIlong": (771.8, 134.0, 143.0, 12.0),
    "TRIlat": (717.5, 113.8, 98.0, 9.0),
    "TRImed": (717.5, 113.8, 90.8, 9.0),
    "ANC": (283.2, 27.0, 18.0, 0.0),
    "SUP": (379.6, 33.0, 28.0, 0.0),
    "BIClong": (525.1, 115.7, 272.3, 0.0),
    "BICshort": (316.8, 132.1, 192.3, 0.0),
    "BRA": (1177.37, 85.8, 53.5, 0.0),
    "BRD": (276.0, 172.6, 133.0, 0.0),
    "PT": (557.2, 49.2, 98.0, 10.0),
    "PQ": (284.7, 28.2, 5.0, 10.0),
}

#: Names of the muscles, in the order of all arrays of this room. The wrist and finger muscles are left out: their
#: moments at the elbow are small.
MUSCLES = tuple(_ROWS)


class MuscleTable(NamedTuple):
    """Properties of the m muscles, shape (m,) each.

    Attributes
    ----------
    force : ndarray
        Peak isometric force, N.
    fibre : ndarray
        Optimal fibre length, m.
    tendon : ndarray
        Slack length of the tendon, m.
    pennation : ndarray
        Angle between fibres and tendon at the optimal fibre length, rad.
    """

    force: FloatArray
    fibre: FloatArray
    tendon: FloatArray
    pennation: FloatArray

    @property
    def volume(self) -> FloatArray:
        """Force times fibre length, N m: proportional to the volume of the muscle."""
        return self.force * self.fibre


def muscle_table(length_scale: float = 1.0, strength_scale: float = 1.0) -> MuscleTable:
    """Properties of a person's muscles.

    Parameters
    ----------
    length_scale : float
        Person's lengths over those of the model.
    strength_scale : float
        Person's muscle forces over those of the model.

    Returns
    -------
    MuscleTable
    """
    rows = np.array(list(_ROWS.values()))
    return MuscleTable(
        rows[:, 0] * strength_scale,
        rows[:, 1] * 1e-3 * length_scale,
        rows[:, 2] * 1e-3 * length_scale,
        np.radians(rows[:, 3]),
    )
