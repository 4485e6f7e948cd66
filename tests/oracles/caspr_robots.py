"""Parts of CASPR's files of cable robots."""

MOMENTS = "<Ixx>0.03</Ixx><Iyy>0.025</Iyy><Izz>0.01</Izz><Ixy>0.001</Ixy><Ixz>0.002</Ixz><Iyz>-0.001</Iyz>"


def link(number, name, joint, parent, at, ref="com", moments=MOMENTS):
    return (
        f'<link_rigid num="{number}" name="{name}"><joint {joint}/><physical><mass>3.0</mass>'
        f"<com_location>0.01 0.02 -0.13</com_location><end_location>0 0 -0.3</end_location>"
        f'<inertia ref="{ref}">{moments}</inertia></physical>'
        f"<parent><num>{parent}</num><location>{at}</location></parent></link_rigid>"
    )


def motion(kind, count, more=""):
    zeros, ones = " ".join(["0"] * count), " ".join(["3"] * count)
    return f'type="{kind}" q_initial="{zeros}" q_min="{ones.replace("3", "-3")}" q_max="{ones}" {more}'


def system(*links):
    return (
        '<?xml version="1.0" encoding="utf-8"?>\n<!DOCTYPE bodies_system SYSTEM "../templates/bodies.dtd">'
        f"<bodies_system><links>{''.join(links)}</links></bodies_system>"
    )


def cables(*routes, reference="com", name="all"):
    found = ""
    for k, route in enumerate(routes):
        points = "".join(f"<attachment><link>{n}</link><location>{at}</location></attachment>" for n, at in route)
        found += (
            f'<cable_ideal name="cable {k}" attachment_reference="{reference}"><properties><force_min>3</force_min>'
            f"<force_max>45</force_max></properties><attachments>{points}</attachments></cable_ideal>"
        )
    return f'<cables default_cable_set="{name}"><cable_set id="all">{found}</cable_set></cables>'


ROUTES = (((0, "0.2 0 0.1"), (1, "0.065 0 0.03"), (2, "0.06 0 0")), ((0, "-0.2 0.1 0"), (2, "0 -0.065 0.01")))
ARM = system(
    link(1, "upper arm", motion("S_EULER_XYZ", 3), 0, "0.1 0.2 0.3"),
    link(2, "forearm", motion("U_XZ", 2, 'actuated="true"'), 1, "0 0.01 -0.3"),
)
