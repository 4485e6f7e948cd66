"""Search for the best design: variables, merit, search, stored studies, and the check of what was found."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
