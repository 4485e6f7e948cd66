"""The report on a design: what it does for one person, on two pages, with what was assumed and not checked."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
