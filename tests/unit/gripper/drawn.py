"""Strategies of scenes as a person might write them: most can be, some cannot."""

from hypothesis import strategies as st

from ajgdata.gripper.grippers import GRIPPERS
from ajgdata.gripper.object_library import OBJECTS

SIZE = st.floats(0.5, 30.0) | st.floats(1.0, 300.0)
COORDINATE = st.floats(-30.0, 30.0) | st.floats(-60.0, 60.0)
ANGLE = st.floats(-360.0, 360.0)
SIZES = {
    "cube": ["edge_mm"],
    "box": ["length_mm", "width_mm", "height_mm"],
    "cylinder": ["diameter_mm", "height_mm"],
    "rod": ["diameter_mm", "length_mm"],
    "sphere": ["diameter_mm"],
}
PRIMITIVES = st.one_of(
    *(
        st.fixed_dictionaries({"kind": st.just(kind)} | {size: SIZE for size in sizes})
        for kind, sizes in SIZES.items()
    ),
    st.fixed_dictionaries(
        {"kind": st.just("ellipsoid"), "diameters_mm": st.tuples(SIZE, SIZE, SIZE)}
    ),
)
LIFTED = st.fixed_dictionaries(
    {"shape": PRIMITIVES},
    optional={
        "x_mm": COORDINATE,
        "y_mm": COORDINATE,
        "angle_deg": ANGLE,
        "lift_mm": st.floats(0, 60),
    },
)
COMPOUNDS = st.builds(
    lambda base, others: {"kind": "compound", "parts": [{"shape": base}, *others]},
    PRIMITIVES,
    st.lists(LIFTED, max_size=3),
)
SHAPES = PRIMITIVES | COMPOUNDS | st.sampled_from(sorted(OBJECTS)) | st.none()
GRIPPER = st.sampled_from(sorted(GRIPPERS)) | st.fixed_dictionaries(
    {},
    optional={
        "rim_radius_mm": st.floats(41.0, 60.0),
        "height_mm": st.floats(20.0, 60.0),
        "balloon_depth_mm": st.floats(10.0, 60.0),
        "bed_depth_mm": st.floats(1.0, 60.0),
        "stiffness_n_m3": st.floats(5e4, 2e6),
        "clearance_mm": st.floats(4.0, 15.0),
    },
)
MEDIUM = st.fixed_dictionaries(
    {},
    optional={
        "kind": st.sampled_from(["plastic", "metal", "coffee", "air"]),
        "grain_diameter_mm": st.floats(0.1, 15.0),
        "porosity": st.floats(0.2, 0.8),
        "heave_deg": st.floats(5.0, 55.0),
        "heave_fraction": st.floats(0.0, 1.0),
    },
)
NUISANCE = st.fixed_dictionaries(
    {},
    optional={
        "roughness_mm": st.floats(0.0, 5.0),
        "roughness_correlation_mm": st.floats(1.0, 50.0),
        "slope_deg": st.floats(0.0, 10.0),
        "force": st.floats(0.0, 0.2),
    },
)
GRASP = st.fixed_dictionaries(
    {"seed": st.integers(0, 2**63 - 1)},
    optional={
        "angle_deg": ANGLE,
        "offset_x_mm": COORDINATE,
        "offset_y_mm": COORDINATE,
        "force_n": st.floats(0.5, 40.0),
        "nuisance": NUISANCE,
    },
)
#: Scenes as plain data.
SCENES = st.fixed_dictionaries(
    {"object": SHAPES, "grasp": GRASP}, optional={"gripper": GRIPPER, "medium": MEDIUM}
)
