"""Joint centres, length offsets, the device's centre and sensor mountings from measured poses and limb lengths."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
