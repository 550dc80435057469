"""The types of all layers: settings in YAML files, sessions, recordings, issues and tables.

No module of this package opens a file. All settings forbid unknown keys, so a misspelt key is an
error. `describe` turns an error of pydantic into one line for the user.
"""

from ajgdata.types.augment import Augment
from ajgdata.types.base import Strict, checked, describe, location
from ajgdata.types.dataset import (
    DatasetSpec,
    ImportSettings,
    JoinSettings,
    OnChange,
    SegmentSettings,
)
from ajgdata.types.errors import DataError, NotPossibleError, many, one_line
from ajgdata.types.excitation import (
    DEFAULT_EXCITATION,
    ExcitationSpec,
    LinearSweep,
    LogSweep,
    MaximumLengthSequence,
    PassiveRecording,
    SoundFile,
    WhiteNoise,
)
from ajgdata.types.features import AnyFeature, FeatureKind, FeatureSettings, TableSettings
from ajgdata.types.issues import (
    ISSUE_LEVELS,
    WHOLE,
    Finding,
    IssueCounts,
    flagged,
    is_of_recording,
    issue_counts,
    left_out,
)
from ajgdata.types.names import LONGEST_NAME, NAME_PATTERN, ModelName, Name, checked_name
from ajgdata.types.protocol import GraspProtocol
from ajgdata.types.recipe import Recipe, RecipeObject
from ajgdata.types.registry import MODELS, Kind, Model
from ajgdata.types.session import (
    HIGHEST_SAMPLE,
    QUALITIES,
    RECORDING_COLUMNS,
    SEGMENT_COLUMNS,
    SESSION_COLUMNS,
    STORE_NAMES,
    TABLE_ROW,
    WHOLE_FILE,
    Acquisition,
    Excitation,
    Recording,
    Segment,
    Session,
    is_reserved,
    part_id,
)
from ajgdata.types.settings import AudioSettings, Level, Target
from ajgdata.types.source import DatasetSource, GitOrigin, GitPart
from ajgdata.types.task_settings import TaskSettings, TrainingSettings
from ajgdata.types.tasks import CROSS_VALIDATION, CrossValidationSettings, Embedding, Task
