"""The wrist in closed form, for stacks of poses, compiled, without Pinocchio."""

import lazy_loader

from ..core.errors.renamed import with_old_names

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
__getattr__ = with_old_names(__name__, __getattr__, dict.fromkeys(("joint_motion", "JointMotion"), "joint_jacobians"))
