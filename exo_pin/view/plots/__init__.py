"""Plots by matplotlib."""

import lazy_loader

from ...core.errors.renamed import with_old_names

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
_NEW_NAMES = {
    "locus_surface": "determinant_map, over flexion and abduction,",
    "draw_mechanism": "exo_pin.view.Scene",
    "method_bars": "Reaction.plot, one figure for each answer,",
    "plot_measured": "plot_force_map with states",
    "shoulder_force_slices": "shoulder_force_map",
}
__getattr__ = with_old_names(__name__, __getattr__, _NEW_NAMES)
