"""The force that a parallel shoulder exoskeleton puts on the shoulder joint.

Describe a mechanism or load a published one, and ask for limb forces, shoulder reaction and singularities in any
pose and motion::

    import exo_pin as ep

    exo = ep.load("prototype").worn_by(ep.Arm.from_anthropometry(1.75, 75, sex="male"))
    print(exo.reaction(ep.shoulder_rotation(30, 20, 0, degrees=True)))
"""

import lazy_loader

__version__ = "0.2.0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
