"""The wrist as a closed chain: written as URDF, recognised, and its equilibrium through Pinocchio."""

import lazy_loader

from ..core.errors.renamed import with_old_names

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
__getattr__ = with_old_names(__name__, __getattr__, {"dummy_shoulder_urdf": "urdf/dummy-shoulder.urdf, a file,"})
