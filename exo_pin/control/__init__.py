"""The built machine in motion: plant, reference trajectories, controllers, sensors, experiments, measured runs."""

import lazy_loader

from ..core.errors.renamed import with_old_names

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
__getattr__ = with_old_names(
    __name__,
    __getattr__,
    {
        "point_to_point": "Turn, with a rotation_vector,",
        "Sequence": "AnglePath, through clinical angles, or OrientationSpline",
        "TimeLaw": 'law="constant_speed" or law="minimum_jerk"',
        "fourth_muscle_holes": "with_fourth_muscle, with missing_moments of each hole,",
    },
)
