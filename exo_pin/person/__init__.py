"""The wearer: muscles, moving shoulder centre, and the contact force of the glenohumeral joint (extra ``person``)."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
