"""The content of session.yaml and recordings.csv."""

from __future__ import annotations

import math
import re
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import AfterValidator, Field, JsonValue, model_validator

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
    "start_s",
    "end_s",
    "table_row",
    "grasp_id",
    "placement_id",
    "sample",
    "object",
    "quality",
)
#: Columns of recordings.csv with the times of a segment; a session without segments lacks them.
SEGMENT_COLUMNS = ("start_s", "end_s")
#: Column of recordings.csv with the row of an imported table; sessions with audio lack it.
TABLE_ROW = "table_row"
#: Values of the column `quality`.
QUALITIES = ("ok", "reject", "clipped")
#: Largest value of `sample`, because the feature file stores a 32-bit integer.
HIGHEST_SAMPLE = 2**31 - 1
#: Keys of session.yaml that become labels of every recording of a session.
SESSION_COLUMNS = ("source", "gripper", "medium")
#: Names in files of features and latents that labels cannot have.
STORE_NAMES = (
    "recording",
    "session_id",
    "flags",
    "channel_levels",
    "feature",
    "frequency",
    "validation_fold",
)
#: Names of dimensions of texts, and of arrays of latents.
_STORE_PATTERN = re.compile(r"string\d+|latent_\d+")


class Segment(NamedTuple):
    """The part of a file that is a recording, in seconds; an infinite end is the end of the file.

    >>> Segment(1, 2.5).frames(8000, 80_000)
    (8000, 20000)
    >>> Segment(1).frames(8000, 80_000)
    (8000, 80000)
    """

    start_s: float = 0.0
    end_s: float = math.inf

    def frames(self, sample_rate_hz: int, count: int) -> tuple[int, int]:
        """Return the first sample, and the sample after the last one, of a file with `count`
        samples per channel. The numbers can be larger than `count`."""
        end = count if math.isinf(self.end_s) else round(self.end_s * sample_rate_hz)
        return round(self.start_s * sample_rate_hz), end

    def sound_id(self, sha256: str) -> str:
        """Return a text that is equal for equal sounds: the sha256 of the file, and the times of a
        segment.

        >>> Segment().sound_id("ab12")
        'ab12'
        >>> Segment(1, 2.5).sound_id("ab12")
        'ab12:1.0-2.5'
        """
        if self == WHOLE_FILE or not sha256:
            return sha256
        return f"{sha256}:{float(self.start_s)}-{float(self.end_s)}"

    def __str__(self) -> str:
        """Return the times, e.g. `1 to 2.5 s`."""
        end = "the end" if math.isinf(self.end_s) else f"{self.end_s:g} s"
        return f"{self.start_s:g} to {end}"


#: The segment of a recording that is a complete file.
WHOLE_FILE = Segment()


def part_id(sha256: str, segment: Segment, table_row: int | None) -> str:
    """Return a text that is equal for equal parts of files: segments, or rows of tables.

    >>> part_id("ab12", WHOLE_FILE, 3)
    'ab12:row 3'
    """
    if table_row is None or not sha256:
        return segment.sound_id(sha256)
    return f"{sha256}:row {table_row}"


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
    table_columns: tuple[str, ...] | None = Field(
        None,
        description="columns of the imported tables of features, whose values are the checksum of "
        "a row; null: the session has sound",
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
        description="checksum of the file, or of the features in `table_row`; without a checksum, "
        "changes are not detected; `ajgdata check NAME --accept` stores it",
    )
    start_s: Annotated[float, Field(ge=0, allow_inf_nan=False)] | None = Field(
        None, description="start of the recording in the file in s; empty: that of the file"
    )
    end_s: Annotated[float, Field(gt=0, allow_inf_nan=False)] | None = Field(
        None, description="end of the recording in the file in s; empty: that of the file"
    )
    table_row: Annotated[int, Field(ge=1)] | None = Field(
        None,
        description="row of the imported table `file`, counted from 1 below the header; empty for "
        "audio",
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

    @model_validator(mode="after")
    def _is_not_empty(self) -> Recording:
        segment = self.segment
        if segment.end_s <= segment.start_s:
            raise ValueError(f"the segment {segment} is empty: start_s must be less than end_s")
        return self

    @property
    def segment(self) -> Segment:
        """The part of the file that is the recording."""
        return Segment(self.start_s or 0.0, math.inf if self.end_s is None else self.end_s)

    @property
    def sound_id(self) -> str:
        """Text that is equal for equal sounds (see `Segment.sound_id`); "" without a sha256."""
        return part_id(self.sha256, self.segment, self.table_row)


def is_reserved(name: str) -> bool:
    """Return whether a label cannot have this name, because a standard column has it.

    Upper and lower case are equal for columns of recordings.csv and session.yaml.
    """
    standard = (*RECORDING_COLUMNS, *SESSION_COLUMNS, SESSION_COLUMN)
    is_array = _STORE_PATTERN.fullmatch(name) is not None
    return name.lower() in standard or name in STORE_NAMES or is_array
