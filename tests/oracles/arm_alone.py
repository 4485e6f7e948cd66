"""An arm in a ball joint without any link of a device."""

import exo_pin as ep

_LINK = (
    '<robot name="bare"><link name="arm"><inertial><mass value="1"/>'
    '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>'
)


def arm_alone():
    """A chain of the arm alone, of 1 kg, for devices whose drives are routes from torso to arm."""
    roles = ep.chain.Roles(arm="arm", shoulder="root_joint")
    return ep.ClosedChain.from_urdf(_LINK, ep.chain.Closures("bare", ep.chain.Root("spherical"), (), roles))
