"""What a session and a recording say of themselves."""

from __future__ import annotations

import re
from typing import Annotated, Any, Literal

from pydantic import Field

from ajgdata.types.base import Name, Strict

#: Columns of recordings.csv that mean the same in every data set; all others are declared targets
#: or free columns.
RECORDING_COLUMNS = ("recording_id", "file", "sha256", "grasp_id", "sample", "object", "quality")
#: Columns that session.yaml gives to every recording of a session.
SESSION_COLUMNS = ("source", "gripper", "medium")
#: Names that the feature store uses itself.
STORE_NAMES = ("recording", "session_id", "flags", "delay_samples", "feature", "frequency")


class Excitation(Strict):
    """The played sound."""

    file: str = Field(description="relative to the session folder")
    sha256: str
    description: str = ""


class Session(Strict):
    """session.yaml: one uninterrupted acquisition with one gripper."""

    session_id: Name
    source: Literal["virtual", "soundcard", "import"]
    gripper: str = "unknown"
    medium: str = "unknown"
    device: str = "unknown"
    sample_rate_hz: int | None = Field(None, description="null when the recordings differ")
    excitation: Excitation | None = None
    audio_root: str | None = Field(
        None, description="folder the files are relative to; null: the session folder"
    )
    software: str = Field("", description="what wrote this session")
    scene: dict[str, Any] = Field({}, description="settings of the source, for provenance")
    skipped: dict[str, str] = Field({}, description="grasps that could not be made, and why")
    notes: str = ""


class Recording(Strict):
    """One row of recordings.csv. `labels` holds every further column as text."""

    recording_id: Annotated[str, Field(min_length=1, max_length=200)]
    file: Annotated[str, Field(min_length=1)]
    sha256: Annotated[str, Field(pattern=r"^([0-9a-f]{64})?$")] = Field(
        "", description="empty: not sealed yet"
    )
    grasp_id: Annotated[str, Field(min_length=1)]
    sample: int = Field(0, ge=0)
    object: str = ""
    quality: str = Field("ok", description="'reject' keeps a recording out; other text is kept")
    labels: dict[str, str] = {}


def is_reserved(name: str) -> bool:
    """Whether a label column cannot have this name, because another column of the store has it."""
    standard = (*RECORDING_COLUMNS, *SESSION_COLUMNS, *STORE_NAMES)
    return name in standard or re.fullmatch(r"string\d+", name) is not None  # netCDF dimensions
