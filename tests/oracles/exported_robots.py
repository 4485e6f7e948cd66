"""A plane leg with one loop in the layout of toolbox-parallel-robots, as CAD exporters write it."""


def exported(tmp_path, loops, more="", motors="name_mot: ['mot1', 'mot2']\n"):
    """A leg as CAD exporters write it: joints name the loop's ends, friction beside them, no stated limits."""

    def link(name, mass="1.5"):
        inertia = '<inertia ixx="0.02" ixy="0" ixz="1e-55" iyy="0.01" iyz="0" izz="0.02"/>'
        if mass == "1e-9":
            inertia = '<inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/>'
        return (
            f'<link name="{name}"><visual><origin xyz="0 0 0" rpy="0 -0 0"/><geometry><mesh filename="package:///{name}'
            f'.stl"/></geometry><material name="{name}_material"><color rgba="0.6 0.6 0.6 1.0"/></material></visual>'
            f'<collision><origin xyz="0 0 0" rpy="0 -0 0"/><geometry><mesh filename="package:///{name}.stl"/></geometry>'
            f'<material name="{name}_material"><color rgba="0.6 0.6 0.6 1.0"/></material></collision><inertial>'
            f'<origin xyz="0.1 1e-17 0" rpy="0 0 0"/><mass value="{mass}"/>{inertia}</inertial></link>'
        )

    def joint(name, parent, child, x, y):
        return (
            f'<joint name="{name}" type="revolute"><origin xyz="{x} {y} 0" rpy="1e-40 -3e-40 0"/>'
            f'<parent link="{parent}"/><child link="{child}"/><axis xyz="0 0 1"/><limit effort="1" velocity="20"/>'
            '<joint_properties friction="0.0"/></joint>'
        )

    def weld(name, parent, x):
        place = (
            f'<origin xyz="{x} 0 0" rpy="0 -0 0"/><parent link="{parent}"/><child link="{name}"/><axis xyz="0 0 0"/>'
        )
        return f'{link(name, "1e-9")}<joint name="{name}_frame" type="fixed">{place}</joint>'

    text = "".join(
        [
            '<robot name="onshape">',
            *(link(name) for name in ("base", "rod", "rod_2", "rod_3", "end", "ball", "ball_2")),
            *(joint("mot1", "base", "rod", 0, 0), joint("free1", "rod", "rod_2", 0.3, 0.4)),
            *(joint("mot2", "base", "rod_3", 1, 0), joint("free2", "rod_3", "end", -0.3, 0.4)),
            *(joint("loop1_A", "rod_2", "ball", 0.2, 0.1), joint("loop1_B", "end", "ball_2", -0.2, 0.1)),
            *(weld("tip_A", "rod_2", 0.2), weld("tip_B", "end", -0.2)),
            "</robot>",
        ]
    )
    (tmp_path / "robot.urdf").write_text(text)
    (tmp_path / "robot.yaml").write_text(loops + motors + more)
    return tmp_path
