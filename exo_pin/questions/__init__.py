"""The questions that a design answers: methods of :class:`exo_pin.ShoulderExo`, by what they are about."""

from .forces import ForceQuestions
from .kinematics import KinematicQuestions
from .unknowns import UncertaintyQuestions

__all__ = ["ForceQuestions", "KinematicQuestions", "Questions", "UncertaintyQuestions"]


class Questions(KinematicQuestions, ForceQuestions, UncertaintyQuestions):
    """All of them."""
