from .shoulder_exo import ShoulderExo as ShoulderExo
from .shoulder_exo import load as load
