"""Options of a plant: estimates, each with its unit and its basis."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from ...core.errors import InvalidInput, UnknownName
from ...core.errors.base import echo
from ...core.validation import as_finite, require_types
from ...muscle.laws.friction import ConstantFriction, Damping, FrictionLaw, LoadDependentFriction
from ...muscle.valve.flow import Supply, Valve, ValveUnit
from .motor_options import JointMotor, LinearActuator, Winch, check_estimates, estimate


def _unit() -> ValveUnit:
    return ValveUnit(Valve(1e-9, 0.3), Valve(1e-9, 0.3), restrictor=Valve(2e-10, 0.5))


@dataclass(frozen=True, kw_only=True)
class PlantOptions:
    """Air, motors, friction and shoulder unit of a plant.

    Every default that the thesis does not print is an estimate, and :attr:`Plant.assumptions` lists it.

    Parameters
    ----------
    supply : Supply or None
        None for a supply that holds the pressure of the actuators of the design.
    valves : ValveUnit
        Of every muscle.
    polytropic_exponent : float
        κ of the air in muscles and manifold, from 1 (isothermal) to 1.4 (adiabatic).
    dead_volume : float
        Of the tube between valve and muscle, m³.
    braid_stiffness : float
        Stiffness of a muscle that is pulled beyond its nominal length, N/m of a muscle of 0.3 m; shorter ones are
        stiffer in proportion.
    muscle_damping : Damping or None
        (3-21); None for none.
    muscle_friction : FrictionLaw or None
        Coulomb friction: :class:`ConstantFriction`, or :class:`LoadDependentFriction`, (3-16) with the pull in place of
        the hung weight. None for none.
    presliding : float
        Displacement over which a muscle's friction builds up, m.
    shoulder_viscous : float
        Moment of viscous friction in the shoulder over angular velocity, N m s/rad.
    shoulder_coulomb : float
        Moment of dry friction in the shoulder, N m.
    shoulder_presliding : float
        Turn over which it builds up, rad.
    second_flange : bool
        Whether the shoulder unit has the flange bearing of Section 5.4.3, so that its range has no end.
    stop_stiffness, stop_damping : float
        Of the ends of the shoulder unit's range, N m/rad and N m s/rad.
    series_spring : float or None
        Stiffness of a spring in series with each muscle (Section 6.2), N/m; None for none.
    pulley_friction : float
        Dry friction of the pulleys between a muscle and its cable over the pull of the muscle.
    winch : Winch
        Of every cable without a tackle.
    linear_actuator : LinearActuator
        Of every linear actuator.
    joint_motor : JointMotor
        Of every drive of a device that states no more than its limits.
    play : float or None
        Backlash between each winch or linear actuator and its limb, end to end, m; None for that which the design
        states (:attr:`exo_pin.Actuator.play`), none where it states none. Of limbs that only pull it is an offset.

    Raises
    ------
    InvalidInput
        If a number is not in its range, or a part has a wrong type.

    Notes
    -----
    The flange bearing is that of thesis Section 5.4.3, the spring that of Section 6.2.

    Source: thesis Table 5-6, Table A-1, Figure 5-20.

    Examples
    --------
    >>> options = ep.PlantOptions(polytropic_exponent=1.4)  # adiabatic air
    >>> options.valves.frequency, ep.PlantOptions().polytropic_exponent  # Hz, as in the thesis; isothermal by default
    (20.0, 1.0)
    """

    supply: Supply | None = None
    valves: ValveUnit = field(default_factory=_unit)
    polytropic_exponent: float = estimate(
        1.0,
        "",
        "no model of the air is printed; isothermal, as the muscles' walls are thin and the motions take seconds",
    )
    dead_volume: float = estimate(2.5e-6, "cm³", "half a metre of tube with a bore of 2.5 mm", 1e6)
    braid_stiffness: float = estimate(
        2960.0, "N/m for 300 mm", "least squares through zero of the six stretched states of Table A-1, without air"
    )
    muscle_damping: Damping | None = field(
        default=Damping.from_bar(-1.0, 0.802),
        metadata={"basis": "(3-30), of the 300 mm muscle: no scaling with length is known"},
    )
    muscle_friction: FrictionLaw | None = field(
        default=None, metadata={"basis": "(3-16) is for a hung weight and a 300 mm muscle; off unless given"}
    )
    presliding: float = estimate(2e-4, "mm", "estimate, below 0.1 % of the length", 1e3)
    shoulder_viscous: float = estimate(0.0, "N m s/rad", "not printed; off unless given")
    shoulder_coulomb: float = estimate(0.0, "N m", "not printed; off unless given")
    shoulder_presliding: float = estimate(2e-3, "rad", "estimate, a tenth of a degree")
    second_flange: bool = False
    stop_stiffness: float = estimate(100.0, "N m/rad", "not printed")
    stop_damping: float = estimate(1.0, "N m s/rad", "not printed")
    series_spring: float | None = estimate(None, "N/m", "Section 6.2 proposes one without a figure")
    pulley_friction: float = estimate(
        0.05, "of the muscle's pull", "estimate: the tackle and an exit pulley, two to three sheaves on ball bearings"
    )
    winch: Winch = field(default_factory=Winch)
    linear_actuator: LinearActuator = field(default_factory=LinearActuator)
    joint_motor: JointMotor = field(default_factory=JointMotor)
    play: float | None = estimate(None, "mm", "that of the design's drives; none where they state none", 1e3)

    def __post_init__(self) -> None:
        if not isinstance(self.second_flange, bool | np.bool_):
            raise InvalidInput(f"expected second_flange as True or False, got {echo(self.second_flange)}")
        kappa = float(as_finite("polytropic_exponent", self.polytropic_exponent, ()))
        if not 1.0 <= kappa <= 1.4:
            raise InvalidInput(f"expected polytropic_exponent from 1 to 1.4, got {kappa:g}")
        check_estimates(self)
        require_types(
            self,
            supply=Supply | None,
            valves=ValveUnit,
            muscle_damping=Damping | None,
            winch=Winch,
            linear_actuator=LinearActuator,
            joint_motor=JointMotor,
            muscle_friction=ConstantFriction | LoadDependentFriction | None,
        )

    def replace(self, **changes: Any) -> PlantOptions:
        """Return a copy with some fields changed.

        Parameters
        ----------
        **changes
            Fields of the class.

        Returns
        -------
        PlantOptions

        Raises
        ------
        UnknownName
            If a name is no field.

        Examples
        --------
        >>> options = ep.PlantOptions().replace(supply=ep.Supply(5e5))
        >>> round(1e-5 * options.supply.pressure, 9), options.valves == ep.PlantOptions().valves  # bar; the rest stays
        (5.0, True)
        """
        known = {item.name for item in fields(self)}
        for name in changes:
            if name not in known:
                raise UnknownName("field", name, known)
        return replace(self, **changes)
