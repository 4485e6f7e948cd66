"""Fields of MuJoCo 4.0's mjModel and mjOption that the package does not read.

Irrelevant are names, pictures, sensors, user data, keyframes' controls, settings of the solver and of the time
integration, everything about contact, and quantities that MuJoCo derives from other fields.
"""

#: Fields that do not change the motion of rigid bodies without contact. A name that ends in * is a group.
IRRELEVANT = (
    # Sizes of other groups and of memory, names, paths.
    *("n*", "name_*", "names_map", "paths", "signature", "buffer"),
    # Derived from fields that are read.
    *("body_rootid", "body_weldid", "body_dofnum", "body_dofadr", "body_treeid", "body_simple", "body_sameframe"),
    *("body_subtreemass", "body_invweight0", "dof_bodyid", "dof_jntid", "dof_parentid", "dof_treeid", "dof_Madr"),
    *("dof_simplenum", "dof_invweight0", "dof_M0", "dof_length", "site_sameframe", "tree_*", "flg_*", "B_*", "M_*"),
    *(
        "D_*",
        "mapM2M",
        "mapM2D",
        "mapD2M",
        "jnt_actuatorid",
        "actuator_acc0",
        "actuator_length0",
        "actuator_lengthrange",
        "stat",
    ),
    # Contact and collision, which are not read.
    *("geom_*", "bvh_*", "oct_*", "mesh_*", "hfield_*", "pair_*", "exclude_*", "body_geomnum", "body_geomadr"),
    *("body_margin", "body_contype", "body_conaffinity", "body_bvhadr", "body_bvhnum"),
    # Pictures, sensors, user data, other parts of keyframes.
    *("cam_*", "light_*", "skin_*", "tex_*", "mat_*", "vis", "sensor_*", "numeric_*", "text_*", "tuple_*", "key_*"),
    *("body_user", "jnt_group", "jnt_user", "site_type", "site_dataid", "site_matid", "site_group", "site_size"),
    *("site_user", "site_rgba", "actuator_user"),
    # How soft MuJoCo makes its constraints, and how it integrates.
    *("jnt_solref", "jnt_solimp", "dof_solref", "dof_solimp", "eq_solref", "eq_solimp", "opt.*"),
    # How a control becomes a force: the efforts of a chain are given as forces.
    *("actuator_ctrlnum", "actuator_ctrlspec", "actuator_outnum", "actuator_actadr", "actuator_actnum"),
    *("actuator_cranklength", "actuator_dynprm", "actuator_actearly"),
    *("actuator_history", "actuator_historyadr", "actuator_delay"),
    # Of gravity compensation, which is refused.
    "jnt_actgravcomp",
)

#: Fields, or groups, that no chain can hold: errors of ``mjcf_refusals`` as soon as a file uses them.
REFUSED = (
    *("body_mocapid", "body_gravcomp", "body_plugin", "jnt_stiffnesspoly", "jnt_springyield", "jnt_plasticadr"),
    *("dof_dampingpoly", "actuator_dampingpoly", "actuator_plugin", "plugin*", "flex*", "efm*", "tendon_*", "ten_*"),
    *("wrap_*", "opt.wind"),
)
