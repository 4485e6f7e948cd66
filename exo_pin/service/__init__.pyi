from .options import ServiceOptions as ServiceOptions
from .problems import Problem as Problem
from .serving import serve as serve
