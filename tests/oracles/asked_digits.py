"""What the digits of a file's numbers make of its loops."""

import re
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from asked_chains import of_mobility, tried
from asked_files import in_short, read
from mechanisms import enlarged, four_bar, placed
from rounded_files import rounded_mjcf, rounded_sdf, rounded_urdf
from rounded_mechanisms import mechanism
from scipy.spatial.transform import Rotation

from exo_pin.chain import ClosedChain, Closures

#: Numbers as they are written, and others beside them.
WORDS = (
    "0.1234", "0.123", "0.1234 0.12345", "0.1234 1 2.5", "0.123456789012", "0.1234567890123", "0.1234 0.12345678901234",
    "1.5708", "1.570796 0.123456789", "1.5707963267948966 0.1234", "-3.14159 0.123456789", "3.142 0.123456789",
    "1.571 0.12345", "1.5709 0.123456789", "0.0003 -0.0008", "3e-05 1.25e-4", "1234 0.0003", "0.0003 0.0001234",
    "1.2340e-4 0.3", "-0.0012340 0.0000003", "12.34e-2 1.2340", "2.5e3 0.12340",
)  # fmt: skip


def of_words():
    """The rounding of four-bars with a frame in places that are written with these digits."""
    plain = four_bar()
    found = []
    for words in WORDS:
        place = " ".join([*words.split(), "0", "0", "0"][:3])
        weld = '<link name="mark"/><joint name="weld" type="fixed"><parent link="crank"/><child link="mark"/>'
        weld += f'<origin xyz="{place}"/></joint>'
        urdf = re.sub(r'(xyz|rpy)="([^"]*)"', _short, plain.urdf).replace("</robot>", f"{weld}</robot>")
        at = Closures(
            "four_bar",
            closures=(replace(plain.closures.closures[0], placement_a=plain.closures.closures[0].placement_b),),
        )
        chain = ClosedChain.from_urdf(urdf, at)
        found.append(
            [words, 1e6 * chain.description.tolerance, 1e6 * chain.description.rounding, chain.description.left_out]
        )
    return found


def _short(found):
    return f'{found[1]}="{" ".join(f"{float(word):.2f}".rstrip("0") for word in found[2].split())}"'


def tilted(tilts=(0.0, 1e-7, 1e-6, 1e-5, 1e-4), tolerances=(0.0, 1e-8, 1e-7, 1e-6, 1e-4, 1e-3)):
    """Mobility of four-bars with one hinge out of the plane, of a geometry that is known to a tolerance."""
    named, found = four_bar(), []
    for tilt in tilts:
        axis = Rotation.from_rotvec([tilt, 0.0, 0.0]).apply([0.0, 0.0, 1.0])
        at = named.urdf.index('name="crank_hinge"')
        words = " ".join(f"{x:.17g}" for x in axis)
        urdf = named.urdf[:at] + named.urdf[at:].replace("0.0 0.0 1.0", words, 1)
        for tolerance in tolerances:
            chain = ClosedChain.from_urdf(urdf, replace(named.closures, tolerance=tolerance))
            large = enlarged(chain, 10.0)
            found.append(
                [
                    tilt,
                    tolerance,
                    tried(lambda chain=chain: _judged(chain, named.q)),
                    tried(lambda large=large: _judged(large, named.q)),
                ]
            )
    return found


def tilted_files(digits=(5, 8), tilts=(0.0, 0.6, 1.2, 2.4, 4.8, 8.0, 12.0, 20.0)):
    """What is read of four-bars in files of so many digits, one hinge out of the plane by some last digits."""
    named, found = four_bar(), []
    (tip,) = named.closures.closures
    for count in digits:
        for tilt in tilts:
            axis = Rotation.from_rotvec([tilt * 10.0**-count, 0.0, 0.0]).apply([0.0, 0.0, 1.0])
            at = named.urdf.index('name="crank_hinge"')
            words = " ".join(f"{x:.17g}" for x in axis)
            urdf = named.urdf[:at] + named.urdf[at:].replace("0.0 0.0 1.0", words, 1)
            # In a place that is known to as many digits.
            urdf = urdf.replace('xyz="0.4 0.0 0.0"', f'xyz="{0.4 + 3.3 * 10.0**-count:.{count}f} 0.0 0.0"')
            x = round(tip.placement_a.translation[0], count)
            closures = replace(named.closures, closures=(replace(tip, placement_a=placed(np.array([x, 0.0, 0.0]))),))
            text = re.sub(r'xyz="([^"]*)"', lambda one: _to_digits(one, count), urdf)  # noqa: B023
            known = tried(lambda: ClosedChain.from_urdf(text, closures).description)  # noqa: B023
            found.append([count, tilt, 1e6 * known.tolerance, 1e6 * known.rounding, known.left_out])
    return found


def _to_digits(found, count):
    return f'xyz="{" ".join(repr(round(float(word), count)) for word in found[1].split())}"'


def _judged(chain, q):
    away = chain.close(q + np.array([0.02, -0.03, 0.01]))
    open_by = [share * 10.0 * 3 * chain.description.tolerance for share in (0.9, 1.1)]
    taken = [
        isinstance(tried(lambda gap=gap: chain.project_velocity(q + np.array([0.0, 0.0, 2.8 * gap]), np.ones(3))), list)
        for gap in open_by
    ]
    forces = tried(lambda: chain.inverse_dynamics(away, actuated=["crank_hinge"]).cautions)
    return [away, *of_mobility(chain.mobility(away, actuated=["crank_hinge"])), taken, forces]


def rounded_files(name, digits, seed=3):
    """A mechanism in files of each format whose geometry is rounded, as they are read."""
    chain, found = mechanism(name, None, seed), {}
    for kind, write in {"urdf": rounded_urdf, "sdf": rounded_sdf, "mjcf": rounded_mjcf}.items():

        def asked(write=write):
            with tempfile.TemporaryDirectory() as folder:
                known = write(chain, digits, Path(folder)).description
            return [1e6 * known.tolerance, 1e6 * known.rounding, list(map(in_short, known.left_out))]

        found[kind] = tried(asked)
    return found


def right_angles():
    """Angles near right ones, exact where a tolerance is given."""
    body = '<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="continuous"><parent link="a"/>'
    body += '<child link="b"/><origin rpy="{}"/></joint></robot>'
    pose = '<sdf version="1.9"><model name="m"><link name="l"><pose {}>0.1 0.2 1.5708 {}</pose></link></model></sdf>'
    found = []
    for words in ("1.5708 -3.1416 0.0001", "1.57 4.7124 1.5", "1.5708 0", "1.5708 x 0", "1e400 0 1.5708"):
        tolerances = (0.0, 1e-5, 1e-3, 0.01, 0.011, -1.0)
        found += [read("urdf", body.format(words), right_angle_tolerance=tolerance) for tolerance in tolerances]
    for given, words in (
        ("", "1.5708 0 -1.5708"),
        ('degrees="true"', "90.0001 0 1.5708"),
        ('rotation_format="quat_xyzw"', "0 0 0.6 0.8"),
    ):
        found.append(read("sdf", pose.format(given, words), right_angle_tolerance=1e-3))
    return found
