"""The content of session.yaml and recordings.csv."""

from __future__ import annotations

import re
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, JsonValue

from ajgdata.types.base import Strict
from ajgdata.types.names import Name

# Columns that tasks can use as `groups`, in addition to grasp_id and labels.
PLACEMENT_COLUMN = "placement_id"  #: each fold holds out one placement of every class
SESSION_COLUMN = "session_id"
#: Columns of recordings.csv with the same meaning in every data set. All other columns are targets
#: of dataset.yaml, or text.
RECORDING_COLUMNS = (
    "recording_id",
    "file",
    "sha256",
    "grasp_id",
    "placement_id",
    "sample",
    "object",
    "quality",
)
#: Values of the column `quality`.
QUALITIES = ("ok", "reject", "clipped")
#: Largest value of `sample`, because the feature file stores a 32-bit integer.
HIGHEST_SAMPLE = 2**31 - 1
#: Keys of session.yaml that become labels of every recording of a session.
SESSION_COLUMNS = ("source", "gripper", "medium")
#: Names in a feature file that labels cannot have.
STORE_NAMES = ("recording", "session_id", "flags", "channel_levels", "feature", "frequency")


class Excitation(Strict):
    """The file of the played sound."""

    file: str = Field(description="path relative to the session folder")
    sha256: str = Field(description="checksum of the file")
    description: str = Field("", description="description of the sound")
    settings: dict[str, Any] | None = Field(
        None,
        description="settings from which the samples can be computed again; null: the file was "
        "imported",
    )


class Acquisition(Strict):
    """Circumstances of a session with a real gripper."""

    finished: bool = Field(
        description="true if all grasps were recorded or skipped; false during the recording and "
        "after a crash"
    )
    setup: dict[str, JsonValue] = Field(
        description="protocol, device and played sound; another setup needs another session"
    )
    driver: dict[str, JsonValue] = Field({}, description="properties of the sound card")
    latency_samples: int | None = Field(
        None,
        description="measured samples from playing to recording, which are removed from the "
        "recordings; null: not measured yet",
    )
    level_dbfs: float | None = Field(None, description="peak of the played sound in dBFS")


#: Values of `source` in sessions with simulated recordings.
SIMULATED_SOURCES = {"virtual", "virtual-import"}


class Session(Strict):
    """session.yaml: one uninterrupted acquisition with one gripper."""

    format: Literal[1] = Field(
        1, description="version of the format of this file and of recordings.csv"
    )
    session_id: Name
    source: Literal["virtual", "virtual-import", "soundcard", "import"] = Field(
        description="source of the recordings; virtual and virtual-import: simulated"
    )
    gripper: str = Field("unknown", description="name of the gripper")
    medium: str = Field("unknown", description="filling of the gripper, e.g. coffee")
    device: str = Field("unknown", description="device that played and recorded")
    sample_rate_hz: int | None = Field(
        None, description="sample rate of the recordings in Hz; null: it differs between them"
    )
    excitation: Excitation | None = Field(None, description="played sound; null: none, or unknown")
    audio_root: str | None = Field(
        None, description="folder that `file` is relative to; null: the session folder"
    )
    imported_as: str | None = Field(
        None, description="text of the imported folder or table that identifies the session"
    )
    has_several_folders: bool | None = Field(
        None,
        description="true if `--session` added another folder; an import then removes no "
        "recordings",
    )
    software: str = Field("", description="program and version that wrote this session")
    scene: dict[str, Any] = Field({}, description="settings of the source, for provenance")
    skipped: dict[str, str] = Field({}, description="reason by grasp that was not recorded")
    notes: str = Field("", description="notes of the operator")
    acquisition: Acquisition | None = Field(
        None, description="circumstances of a session with a real gripper; null for other sources"
    )

    @property
    def is_simulated(self) -> bool:
        """Whether the recordings are simulated."""
        return self.source in SIMULATED_SOURCES


def checked_quality(text: str) -> str:
    """Return a value of `quality` in lower case. Raises ValueError for an unknown value."""
    if text.lower() not in ("", *QUALITIES):
        raise ValueError(f"unknown value; use {', '.join(QUALITIES)}, and another column for notes")
    return text.lower()


class Recording(Strict):
    """One row of recordings.csv. `labels` contains all other columns as text."""

    recording_id: Annotated[str, Field(min_length=1, max_length=200)] = Field(
        description="name of the recording, unique in the session"
    )
    file: Annotated[str, Field(min_length=1)] = Field(
        description="path of the file inside the session folder (or inside `audio_root`)"
    )
    sha256: Annotated[str, Field(pattern=r"^([0-9a-f]{64})?$")] = Field(
        "",
        description="checksum of the file; without a checksum, changes of the file are not "
        "detected; `ajgdata check NAME --accept` stores it",
    )
    grasp_id: Annotated[str, Field(min_length=1)] = Field(
        description="one closing of the gripper on an object; the default group of cross-validation"
    )
    placement_id: str = Field(
        "",
        description="one placing of an object, which several grasps can share; empty if unknown, "
        "and for the empty gripper",
    )
    sample: int = Field(
        0, ge=0, le=HIGHEST_SAMPLE, description="number of the recording within the grasp"
    )
    object: str = Field("", description="object in the gripper; empty for the empty gripper")
    quality: Annotated[str, AfterValidator(checked_quality)] = Field(
        "ok", description="`ok`, `clipped`, or `reject`, which excludes the recording"
    )
    labels: dict[str, str] = Field({}, description="all other columns: targets, and text")


def is_reserved(name: str) -> bool:
    """Return whether a label cannot have this name, because a standard column has it.

    Upper and lower case are equal for columns of recordings.csv and session.yaml.
    """
    standard = (*RECORDING_COLUMNS, *SESSION_COLUMNS, SESSION_COLUMN)
    is_netcdf_dimension = re.fullmatch(r"string\d+", name) is not None
    return name.lower() in standard or name in STORE_NAMES or is_netcdf_dimension
