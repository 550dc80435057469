"""The nouns: what a data set declares, what a session says, what one recording is.

Nothing here opens a file. Every model forbids unknown keys, so that a typing error is an error;
`describe` turns pydantic's complaint into the one line that a person can act on.
"""

from ajgdata.types.base import (
    NAME,
    DataError,
    Finding,
    ModelName,
    Name,
    SourceName,
    Strict,
    describe,
)
from ajgdata.types.dataset import DatasetSpec, ImportSettings
from ajgdata.types.embedding import Embedding
from ajgdata.types.recipe import Recipe, RecipeObject
from ajgdata.types.registry import MODELS, SOURCES, Kind, Model, Registry, SourceMaker
from ajgdata.types.session import (
    RECORDING_COLUMNS,
    SESSION_COLUMNS,
    STORE_NAMES,
    Excitation,
    Recording,
    Session,
    is_reserved,
)
from ajgdata.types.settings import AudioSettings, FeatureSettings, Level, Target
from ajgdata.types.tasks import CROSS_VALIDATION, Task

__all__ = [
    "CROSS_VALIDATION",
    "MODELS",
    "NAME",
    "RECORDING_COLUMNS",
    "SESSION_COLUMNS",
    "SOURCES",
    "STORE_NAMES",
    "AudioSettings",
    "DataError",
    "DatasetSpec",
    "Embedding",
    "Excitation",
    "FeatureSettings",
    "Finding",
    "ImportSettings",
    "Kind",
    "Level",
    "Model",
    "ModelName",
    "Name",
    "Recipe",
    "RecipeObject",
    "Recording",
    "Registry",
    "Session",
    "SourceMaker",
    "SourceName",
    "Strict",
    "Target",
    "Task",
    "describe",
    "is_reserved",
]
