"""Pneumatic muscles: force laws, their dynamics, and how both are identified.

The source is R. Tang, Design of a Parallel Shoulder Assistive Robot with Pneumatic Muscle Actuators, Chapter 3 and
Appendices A and B. Contraction x is in m, positive when shorter than nominal; gauge pressure P in Pa; force in N,
positive when pulling.

>>> from exo_pin.muscle import Muscle, muscle_model
>>> model = muscle_model("best")
>>> round(float(model.force(0.050, 3.5e5)), 2)
28.88
>>> limb = Muscle(model=model.scaled(0.150), end_fitting=0.100)
>>> lower, upper = limb.force_limits([0.220, 0.240])
>>> upper.round(1).tolist()
[27.8, 68.1]
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
