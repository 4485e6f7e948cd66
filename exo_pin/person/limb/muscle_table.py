"""Properties of the muscles of the shoulder, elbow and forearm, and their force over length and velocity.

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

With the source's numbers (``data/muscles.csv``) on MyoArm's paths the fibres of all shoulder muscles stay between 0.48
and 1.65 of their optimal length over the range of motion.

**Force of a muscle** over its length and velocity: a Hill muscle with a rigid tendon.
With the activation a, the normalised fibre length l and velocity v, the tendon force is

    T = F0 cos α [a active(l) velocity(v) + passive(l)],

with the angle α between fibres and tendon from a muscle of constant thickness. The tendon is rigid: it stretches by
3.3 % at most, and a static pose does not store its energy.

The curves are those of M. Millard et al., "Flexing computational muscle", J. Biomech. Eng. 135 (2013) 021005, with the
parameters of the MoBL-ARMS model: tables of OpenSim 4.6's ``ActiveForceLengthCurve``, ``FiberForceLengthCurve`` and
``ForceVelocityCurve`` in ``data/curves.csv``, interpolated monotonically (within 0.005 of the curves).
"""

from __future__ import annotations

import functools
from importlib.resources import files
from typing import Any, NamedTuple

import numpy as np
import scipy

from ...core.files.csv_tables import CsvTable, parse_csv
from ...core.validation import FloatArray


def data_table(name: str) -> CsvTable:
    """One of the tables in the folder ``data`` beside this file."""
    file = files("exo_pin.person") / "limb" / "data" / f"{name}.csv"
    return parse_csv(file.read_text(encoding="utf-8"), file.name)


_TABLE = data_table("muscles")
_ROWS = _TABLE.numbers(("force_N", "fibre_mm", "tendon_mm", "pennation_deg"))
#: Names of the muscles, in the order of all arrays of this room.
MUSCLES = tuple(row[0] for row in _TABLE.rows)
#: The muscles that hold the head in its socket: supraspinatus, infraspinatus, subscapularis, teres minor.
ROTATOR_CUFF = ("SUPSP", "INFSP", "SUBSC", "TMIN")
#: Middle deltoid and supraspinatus, which raise the arm sideways.
ABDUCTORS = ("DELT2", "SUPSP")
#: Body mass whose arm, by the table of de Leva (1996) for men, weighs as much as the arm of the MoBL-ARMS model, kg.
MODEL_MASS = 3.91832 / 0.0494
#: Strength besides what mass makes of it, of all muscles and of the abductors besides: with these, women of 67 kg have
#: 43 % of the abduction, 54 % of the flexion and 57 % of the outward rotation of men of 85 kg (measured: 43, 55, 56 %).
BY_SEX = {"male": (1.0, 1.0), "female": (0.76, 0.50 / 0.76)}


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


def muscle_table(
    length_scale: float = 1.0, strength_scale: float = 1.0, cuff_scale: float = 1.0, abductor_scale: float = 1.0
) -> MuscleTable:
    """Properties of a person's muscles.

    Parameters
    ----------
    length_scale : float
        Person's lengths over those of the model.
    strength_scale : float
        Person's muscle forces over those of the model.
    cuff_scale, abductor_scale : float
        The same of the rotator cuff and of the abductors, besides.

    Returns
    -------
    MuscleTable
    """
    force, fibre, tendon, pennation = _ROWS.T
    factor = strength_scale * np.where(np.isin(MUSCLES, ROTATOR_CUFF), cuff_scale, 1.0)
    factor = factor * np.where(np.isin(MUSCLES, ABDUCTORS), abductor_scale, 1.0)
    return MuscleTable(force * factor, fibre * 1e-3 * length_scale, tendon * 1e-3 * length_scale, np.radians(pennation))


#: Shortening velocity at which a muscle has no force, optimal fibre lengths per second.
_FASTEST = 10.0
#: Slope of the passive curve beyond its last point, where it is a straight line.
_PASSIVE_SLOPE = 6.3163


class MuscleState(NamedTuple):
    """What muscles can do at given lengths and velocities, shape (..., m) each.

    Attributes
    ----------
    fibre : ndarray
        Fibre length over the optimal one.
    active : ndarray
        Tendon force per activation, N.
    passive : ndarray
        Tendon force without activation, N.
    """

    fibre: FloatArray
    active: FloatArray
    passive: FloatArray


@functools.cache
def _interpolated(curve: str) -> Any:
    table = data_table("curves")
    chosen = [row[0] == curve for row in table.rows]
    return scipy.interpolate.PchipInterpolator(*table.numbers(("at", "force"))[chosen].T)


def active_curve(fibre: FloatArray) -> FloatArray:
    """Active force over the peak force at a normalised fibre length."""
    curve = _interpolated("active")
    return np.asarray(curve(np.clip(fibre, curve.x[0], curve.x[-1])))


def passive_curve(fibre: FloatArray) -> FloatArray:
    """Force of the fibres at rest over the peak force, at a normalised fibre length; zero below 1."""
    curve = _interpolated("passive")
    inside = curve(np.clip(fibre, curve.x[0], curve.x[-1]))
    return np.asarray(inside + _PASSIVE_SLOPE * np.maximum(fibre - curve.x[-1], 0.0))


def velocity_curve(velocity: FloatArray) -> FloatArray:
    """Factor of the active force at a normalised velocity: 0 at -1 (shortening at full speed), 1 at 0, 1.4 at 1."""
    return np.asarray(_interpolated("velocity")(np.clip(velocity, -1.0, 1.0)))


def muscle_state(
    table: MuscleTable, length: FloatArray, velocity: FloatArray | None = None, passive: bool = True
) -> MuscleState:
    """State of muscles at given path lengths.

    Parameters
    ----------
    table : MuscleTable
        Properties of the muscles.
    length : ndarray
        Length of the whole path, muscle and tendon, shape (..., m), m.
    velocity : ndarray, optional
        Rate of that length, shape (..., m), m/s, positive where it grows. Zero if left out.
    passive : bool
        Whether stretched fibres pull without activation.

    Returns
    -------
    MuscleState
        A path shorter than its tendon is slack: no force.
    """
    height = table.fibre * np.sin(table.pennation)
    along = np.maximum(length - table.tendon, 0.0)
    fibre = np.hypot(along, height)
    cosine = along / np.maximum(fibre, 1e-12)
    normal = fibre / table.fibre
    strength = table.force * cosine
    active = strength * active_curve(normal)
    if velocity is not None:
        # Fibres of constant thickness: their rate is that of the path, times the cosine.
        active = active * velocity_curve(velocity * cosine / (table.fibre * _FASTEST))
    still = strength * passive_curve(normal) if passive else np.zeros_like(strength)
    return MuscleState(normal, active, still)
