from .record import DesignReport as DesignReport
from .record import DriveNeed as DriveNeed
from .record import Hazard as Hazard
from .record import PersonFit as PersonFit
from .record import Posture as Posture
from .record import Task as Task
