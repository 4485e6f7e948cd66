"""Units that keys of files end in."""

import math

#: Unit suffixes of keys, and the factor to SI.
UNITS: dict[str, dict[str, float]] = {
    "length": {"_m": 1.0, "_mm": 1e-3},
    "angle": {"_rad": 1.0, "_deg": math.pi / 180.0},
    "area": {"_m2": 1.0, "_cm2": 1e-4, "_mm2": 1e-6},
    "mass": {"_kg": 1.0, "_g": 1e-3},
    "inertia": {"_kg_m2": 1.0, "_g_mm2": 1e-9},
    "speed": {"_m_s": 1.0, "_mm_s": 1e-3},
    "rate": {"_rad_s": 1.0, "_deg_s": math.pi / 180.0},
    "power": {"_W": 1.0},
    "acceleration": {"_m_s2": 1.0},
    "stiffness": {"_N_m": 1.0, "_N_mm": 1e3},
    "twist stiffness": {"_N_m_rad": 1.0},
    "coupling stiffness": {"_N": 1.0},
    "couple": {"_N_m": 1.0},
    "rigidity": {"_N_m2": 1.0},
    "force": {"_N": 1.0, "_kN": 1e3},
    "pressure": {"_Pa": 1.0, "_bar": 1e5},
    "number": {"": 1.0},
}
