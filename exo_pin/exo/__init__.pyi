from .loading import load as load
from .shoulder_exo import ShoulderExo as ShoulderExo
