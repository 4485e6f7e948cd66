from .case import Case as Case
from .motion_and_load import CentreOffset as CentreOffset
from .motion_and_load import CentrePath as CentrePath
from .motion_and_load import Load as Load
from .motion_and_load import Motion as Motion
from .record_checks import MeasurementNoise as MeasurementNoise
from .trajectories import Movement as Movement
from .trajectories import read_movement as read_movement
