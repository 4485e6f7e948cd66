"""The wrist as a closed chain: written as URDF, recognised, and its equilibrium through Pinocchio."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
