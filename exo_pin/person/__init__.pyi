from .contact.assumption_range import ContactOptions as ContactOptions
from .contact.assumption_range import ContactRange as ContactRange
from .contact.device import DeviceAction as DeviceAction
from .contact.result import JointContact as JointContact
from .external_loads import write_external_loads as write_external_loads
from .limb.muscle_table import MUSCLES as MUSCLES
from .wearer import Person as Person
