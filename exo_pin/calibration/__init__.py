"""Joint centres, length offsets, the device's centre and sensor mountings from measured poses and limb lengths."""

import lazy_loader

from ..core.errors.renamed import with_old_names

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
__getattr__ = with_old_names(
    __name__,
    __getattr__,
    {"PoseInformation": "Information", "SuggestedPoses": "suggest_poses, which returns the indices of the candidates,"},
)
