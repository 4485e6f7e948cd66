"""The scene in three dimensions by Meshcat, and plots by matplotlib."""

import lazy_loader

from ..core.errors.renamed import with_old_names

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
__getattr__ = with_old_names(
    __name__, __getattr__, {"Recording": "SceneRecording", "Browser": "Scene.save_png", "DeviceScene": "Scene"}
)
