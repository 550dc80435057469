"""What rules `features` and `merge` do for a data set, in this process."""

from collections.abc import Sequence

from ajgdata.paths import Paths
from ajgdata.pipeline.extract_features import extract_features
from ajgdata.pipeline.merge import merge
from ajgdata.types import DatasetSpec


def extract_sessions(
    project: Paths, spec: DatasetSpec, sessions: Sequence[str], threads: int = 1
) -> None:
    """Make the features of each session."""
    name = spec.name
    for session in sessions:
        extract_features(
            folder=project.session(name, session),
            audio=spec.audio,
            features=spec.features,
            code="",
            shard=project.shard(name, session),
            findings=project.shard_findings(name, session),
            labels=project.shard_labels(name, session),
            threads=threads,
        )


def merge_sessions(project: Paths, spec: DatasetSpec, sessions: Sequence[str]) -> None:
    """Make the store of the data set of the features of its sessions."""
    name = spec.name
    merge(
        dataset=name,
        shards=[project.shard(name, one) for one in sessions],
        labels=[project.shard_labels(name, one) for one in sessions],
        findings=[project.shard_findings(name, one) for one in sessions],
        targets=spec.targets,
        store=project.features(name),
        quarantine=project.quarantine(name),
    )
