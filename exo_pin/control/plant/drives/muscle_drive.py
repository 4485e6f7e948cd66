"""A limb that pneumatic muscles pull, in line with it or over a tackle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ....core.errors import MissingData
from ....core.validation import FloatArray
from ....design import Limb
from ....muscle.io.published import muscle_model
from ....muscle.laws.friction import ConstantFriction, LoadDependentFriction
from ....muscle.laws.literature import ChouHannaford
from ....muscle.laws.static import BAR, StaticModel
from ..equations.muscle_kernels import COLUMNS
from ..options import PlantOptions
from .drive import Drive

#: Whose thread gives the volume of the air.
_THREAD = "fitted-chou-hannaford"
#: Nominal length of the muscle whose braid has the stated stiffness, m.
_BRAID_LENGTH = 0.3
#: Tension that keeps a cable taut, N: that of the search which found the shipped designs.
LEAST_TENSION = 5.0


@dataclass(frozen=True)
class MuscleDrive(Drive):
    """Pneumatic muscles.

    Attributes
    ----------
    model : StaticModel
        Static law of one muscle, scaled to its length.
    taut_length : float
        Length of the limb at which the muscle is as long as at rest, m.
    supply_pressure : float
        Greatest gauge pressure, Pa.
    options : PlantOptions
        Friction, damping, braid, dead volume.
    ratio : float
        Of the tackle; 1 in line.
    count : int
        Muscles side by side.
    """

    model: StaticModel
    taut_length: float
    supply_pressure: float
    options: PlantOptions
    ratio: float = 1.0
    count: int = 1

    @property
    def over_tackle(self) -> bool:
        """Whether the limb is a cable over pulleys."""
        return self.word == "cable"

    def row(self) -> FloatArray:
        """See :meth:`Drive.row`."""
        model, options = self.model, self.options
        thread = muscle_model(_THREAD)
        assert isinstance(thread, ChouHannaford)
        line = model.validity.capability_line
        intercept = float(line(np.array(0.0)))
        slope = float(line(np.array(BAR))) - intercept if np.isfinite(intercept) else 0.0
        share = thread.reference_length / model.length
        pulleys = options.pulley_friction if self.over_tackle else 0.0
        rubs = options.muscle_friction is not None or pulleys > 0.0
        values = {
            "nominal_length": model.length,
            "end_fitting": self.taut_length - model.length,
            "capability_slope": slope,
            "capability_intercept": intercept if np.isfinite(intercept) else 1e9,
            "braid_stiffness": options.braid_stiffness * _BRAID_LENGTH / model.length,
            "presliding": options.presliding if rubs else 1.0,
            "spring_stiffness": options.series_spring or 0.0,
            "thread": thread.braid_length / share,
            "turns": thread.turns / share,
            "dead_volume": options.dead_volume,
            "ratio": self.ratio,
            "count": float(self.count),
            "pulley_friction": pulleys,
        }
        if options.muscle_damping is not None:
            values |= {"damping_1": options.muscle_damping.D_1 * BAR, "damping_2": options.muscle_damping.D_2 * BAR}
        values |= _friction(options)
        return np.array([values.get(name, 0.0) for name in COLUMNS])


def _friction(options: PlantOptions) -> dict[str, float]:
    law = options.muscle_friction
    if isinstance(law, ConstantFriction):
        return {"friction": law.force}
    if isinstance(law, LoadDependentFriction):
        terms = {"friction_2": law.N_2 * BAR, "friction_1": law.N_1 * BAR, "friction_0": law.N_0 * BAR}
        return terms | {"friction_load": law.load / BAR}
    return {}


def muscle_drive(limb: Limb, place: str, options: PlantOptions) -> MuscleDrive:
    """The muscles of a limb.

    Raises
    ------
    MissingData
        If force law, stroke or end fitting are not known; it names them as parts of ``place``.
    """
    actuator, stroke = limb.actuator, limb.stroke
    tackle = None if actuator is None else actuator.tackle
    missing = []
    if actuator is None or (actuator.force_law is None and tackle is None):
        missing.append(f"{place}.actuator.force_law")
    if stroke is None or stroke.end_fitting is None:
        missing.append(f"{place}.stroke.end_fitting")
    if missing:
        raise MissingData(missing, "a plant with pneumatic muscles")
    assert actuator is not None
    assert stroke is not None
    assert stroke.end_fitting is not None
    short, long = (stroke.nominal_length * share + stroke.end_fitting for share in (stroke.shortest, stroke.longest))
    if tackle is not None:
        model = muscle_model(tackle.force_law, tackle.muscle_length)
        return MuscleDrive(
            "cable", short, long, LEAST_TENSION, model, long, tackle.supply_pressure, options, tackle.ratio,
            tackle.count,
        )  # fmt: skip
    assert actuator.force_law is not None
    assert actuator.supply_pressure is not None
    model = muscle_model(actuator.force_law, stroke.nominal_length)
    taut = stroke.nominal_length + stroke.end_fitting
    return MuscleDrive("muscle", short, long, 0.0, model, taut, actuator.supply_pressure, options)
