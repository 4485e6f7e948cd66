"""The force that the exoskeleton puts on the shoulder joint, and which part of it equilibrium determines."""

import lazy_loader

from ..core.errors.renamed import with_old_names

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
__getattr__ = with_old_names(__name__, __getattr__, {"SingularApproach": "exo_pin.wrist.NearestSingularity"})
