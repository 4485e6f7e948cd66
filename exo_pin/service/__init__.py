"""The service: questions over HTTP and live streams, answered by the code that answers a line of ``exo-pin batch``."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
