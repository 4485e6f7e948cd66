from .assumed_masses import AssumedMasses as AssumedMasses
from .recognition import Recognised as Recognised
from .recognition import wrist_of as wrist_of
from .wrist_urdf import PARTS as PARTS
from .wrist_urdf import mechanism_urdf as mechanism_urdf
