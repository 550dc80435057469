"""Sessions and recordings as they describe themselves."""

from __future__ import annotations

import re
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, JsonValue

from ajgdata.types.base import Name, Strict

#: Columns of groups: placements, whose folds hold out one of every class, and sessions.
PLACEMENT_COLUMN, SESSION_COLUMN = "placement_id", "session_id"
#: Columns of recordings.csv that mean the same in every data set; all others are declared targets
#: or free columns.
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
#: The feature file stores `sample` as a 32-bit integer.
HIGHEST_SAMPLE = 2**31 - 1
#: Columns that session.yaml gives to every recording of a session.
SESSION_COLUMNS = ("source", "gripper", "medium")
#: Names that the feature store uses itself.
STORE_NAMES = ("recording", "session_id", "flags", "channel_levels", "feature", "frequency")


class Excitation(Strict):
    """The played sound."""

    file: str = Field(description="relative to the session folder")
    sha256: str = Field(description="of its file")
    description: str = Field("", description="what it is, for people")
    settings: dict[str, Any] | None = Field(
        None, description="its declaration, which makes its samples again; null if it was imported"
    )


class Acquisition(Strict):
    """Circumstances of a session with a real gripper."""

    finished: bool = Field(description="false while it is recorded, and after a crash")
    setup: dict[str, JsonValue] = Field(
        description="protocol, device and played sound: a session with others is another one"
    )
    driver: dict[str, JsonValue] = Field({}, description="what the sound card says of itself")
    latency_samples: int | None = Field(
        None, description="from playing to hearing, measured and taken out"
    )
    level_dbfs: float | None = Field(None, description="peak of the played sound")


#: Values of `source` of sessions whose recordings were simulated.
SIMULATED_SOURCES = {"virtual", "virtual-import"}


class Session(Strict):
    """session.yaml: one uninterrupted acquisition with one gripper."""

    format: Literal[1] = Field(
        1, description="version of the format of this file and of recordings.csv"
    )
    session_id: Name
    source: Literal["virtual", "virtual-import", "soundcard", "import"] = Field(
        description="what made it; virtual and virtual-import are simulated"
    )
    gripper: str = Field("unknown", description="name of the gripper")
    medium: str = Field("unknown", description="what the gripper is filled with")
    device: str = Field("unknown", description="what played and recorded")
    sample_rate_hz: int | None = Field(None, description="null when the recordings differ")
    excitation: Excitation | None = Field(None, description="the played sound, if there was one")
    audio_root: str | None = Field(
        None, description="folder the files are relative to; null: the session folder"
    )
    imported_as: str | None = Field(
        None, description="text of the imported folder or table that identifies the session"
    )
    has_several_folders: bool | None = Field(
        None, description="true if `--session` added another folder; nothing is then pruned"
    )
    software: str = Field("", description="what wrote this session")
    scene: dict[str, Any] = Field({}, description="settings of the source, for provenance")
    skipped: dict[str, str] = Field({}, description="grasps that could not be made, and why")
    notes: str = Field("", description="what the operator noted")
    acquisition: Acquisition | None = Field(None, description="null unless a real gripper's")

    @property
    def is_simulated(self) -> bool:
        """Whether a simulation made its recordings."""
        return self.source in SIMULATED_SOURCES


def checked_quality(text: str) -> str:
    """Return a value of `quality` in lower case. Raises ValueError for an unknown value."""
    if text.lower() not in ("", *QUALITIES):
        raise ValueError(f"unknown value; use {', '.join(QUALITIES)}, and another column for notes")
    return text.lower()


class Recording(Strict):
    """One row of recordings.csv. `labels` holds every further column as text."""

    recording_id: Annotated[str, Field(min_length=1, max_length=200)] = Field(
        description="unique in its session"
    )
    file: Annotated[str, Field(min_length=1)] = Field(
        description="relative to the session folder (or to audio_root); may not leave it"
    )
    sha256: Annotated[str, Field(pattern=r"^([0-9a-f]{64})?$")] = Field(
        "",
        description="checksum of the file; if empty, changes are not noticed: "
        "`ajgdata check NAME --accept` stores it",
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
        0, ge=0, le=HIGHEST_SAMPLE, description="number of the repeat within the grasp"
    )
    object: str = Field("", description="what was held")
    quality: Annotated[str, AfterValidator(checked_quality)] = Field(
        "ok", description="`ok`, `clipped`, or `reject`, which excludes the recording"
    )
    labels: dict[str, str] = Field({}, description="every other column: a target, or kept as text")


def is_reserved(name: str) -> bool:
    """Return True if no label can have this name, because a standard column has it.

    Names of the data model are compared without regard to case.
    """
    standard = (*RECORDING_COLUMNS, *SESSION_COLUMNS, "session_id")
    if name.lower() in standard or name in STORE_NAMES:
        return True
    return re.fullmatch(r"string\d+", name) is not None  # dimensions of netCDF files
