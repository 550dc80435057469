"""Small projects for the examples: few cubes, of a coarse simulation or of tones."""

import yaml

from ajgdata.paths import Paths
from ajgdata.pipeline.acquire import acquire_all
from ajgdata.pipeline.extract_features import extract_features
from ajgdata.pipeline.merge import merge
from ajgdata.pipeline.recipes import recipe_sessions
from ajgdata.store.sessions import read_dataset

EDGES_MM = (12.0, 18.0, 24.0, 30.0)
CUBES = [
    {
        "name": f"cube_{edge:g}",
        "shape": {"kind": "cube", "edge_mm": edge},
        "targets": {"edge_mm": edge},
    }
    for edge in EDGES_MM
]
SIZE = {
    "name": "size",
    "title": "Edge length of cubes",
    "description": "Four cubes on a coarse grid, for tests.",
    "licence": "CC0-1.0",
    "targets": {"edge_mm": {"kind": "regression", "unit": "mm", "description": "edge length"}},
    "tasks": {"size": {"target": "edge_mm", "folds": 4, "models": ["linear"]}},
    "recipe": {
        "seed": 1,
        "grasps_per_object": 4,
        "vary": {"angle_deg": [-10, 10], "offset_x_mm": [-2, 2]},
        "scene": {"numerics": {"dx_mm": 6, "max_time_s": 0.006}},
        "objects": CUBES,
    },
}
OTHER = {
    "name": "size_other_membrane",
    "from": "size",
    "title": "The same with a stiffer membrane",
    "recipe": {"scene": {"gripper": {"membrane": {"stiffness_n_m3": 400000.0}}}},
}


def make(paths: Paths) -> None:
    """Both data sets: declared, recorded, features made."""
    for declared in (SIZE, OTHER):
        path = paths.dataset(declared["name"])
        path.parent.mkdir(parents=True)
        path.write_text(yaml.safe_dump(declared, sort_keys=False))
    wanted = [(d["name"], s) for d in (SIZE, OTHER) for s in recipe_sessions(paths, d["name"])]
    for _ in acquire_all(paths, wanted):
        pass
    for name, session in wanted:  # one session of each
        spec = read_dataset(paths, name)
        shard, labels = paths.shard(name, session), paths.shard_labels(name, session)
        findings = paths.shard_findings(name, session)
        extract_features(
            folder=paths.session(name, session), audio=spec.audio, features=spec.features, code="",
            shard=shard, findings=findings, labels=labels,
        )  # fmt: skip
        merge(
            dataset=name, shards=[shard], labels=[labels], findings=[findings],
            targets=spec.targets, store=paths.features(name), quarantine=paths.quarantine(name),
        )  # fmt: skip
