"""What can go wrong, one class a kind, each with its evidence as attributes; and categories of warnings."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
