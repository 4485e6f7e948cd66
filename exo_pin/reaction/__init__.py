"""The force that the exoskeleton puts on the shoulder joint, and which part of it equilibrium determines."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
