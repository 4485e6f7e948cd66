"""Data of a model's joints, array by array."""

import numpy as np


def here(chain, q, name):
    own = q[chain.configuration_slice(name)]
    return own[0] if len(own) == 1 else np.arctan2(own[1], own[0])
