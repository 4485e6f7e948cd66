"""Checks that a mechanism, its closed forms and its chain are consistent, for any design."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
