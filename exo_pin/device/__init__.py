"""Any closed chain that carries an arm: its poses, its drives and springs, and its equilibrium."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
