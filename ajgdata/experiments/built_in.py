"""Specifications of the experiments of this package, in the order of the report.

The module of this package with the name of an experiment measures and draws it. Light: Snakemake
imports this module, and no module that measures.
"""

from __future__ import annotations

from ajgdata.experiments.division import ByFile, ByModel
from ajgdata.experiments.settings import (
    ConformalIntervalsSettings,
    CrossGripperSettings,
    LearningCurveSettings,
    NovelObjectsSettings,
    ReflectedEnergySettings,
    RepeatedFitsSettings,
    ShortcutSettings,
    SortingSettings,
    TransferSettings,
    VariantsSettings,
    check_energies,
)
from ajgdata.experiments.spec import ExperimentSpec
from ajgdata.types import CrossValidationSettings, Embedding

_SPECS = (
    ExperimentSpec(
        name="cross_validation",
        title="Cross-validation",
        settings=CrossValidationSettings,
        division=ByModel(),
        order=1,
        vectors=True,
        by_placement=True,
        augments=True,
        balances=True,
        covariates=True,
    ),
    ExperimentSpec(
        name="reflected_energy",
        title="Reflected energy",
        settings=ReflectedEnergySettings,
        check=check_energies,
        order=10,
        kinds=("classification",),
    ),
    ExperimentSpec(
        name="shortcut",
        title="Shortcut",
        settings=ShortcutSettings,
        division=ByModel(),
        order=15,
    ),
    ExperimentSpec(
        name="learning_curve",
        title="Learning curve",
        settings=LearningCurveSettings,
        division=ByModel(),
        order=30,
    ),
    ExperimentSpec(
        name="conformal_intervals",
        title="Conformal intervals",
        settings=ConformalIntervalsSettings,
        division=ByModel(),
        order=35,
        kinds=("regression",),
    ),
    ExperimentSpec(
        name="sorting",
        title="Sorting",
        settings=SortingSettings,
        division=ByModel(),
        order=40,
        kinds=("classification",),
    ),
    ExperimentSpec(
        name="novel_objects",
        title="Novel objects",
        settings=NovelObjectsSettings,
        order=45,
    ),
    ExperimentSpec(
        name="cross_gripper",
        title="New gripper",
        settings=CrossGripperSettings,
        division=ByModel(),
        order=60,
    ),
    ExperimentSpec(
        name="transfer",
        title="New group",
        settings=TransferSettings,
        division=ByModel(),
        order=65,
        by_placement=True,
        balances=True,
    ),
    ExperimentSpec(
        name="repeated_fits",
        title="Repeated fits",
        settings=RepeatedFitsSettings,
        division=ByModel(),
        order=70,
        by_placement=True,
        balances=True,
    ),
    ExperimentSpec(
        name="variants",
        title="Variants",
        settings=VariantsSettings,
        division=ByFile(),
        order=70,
        reads_recordings=True,
        renders=True,
        by_placement=True,
    ),
    ExperimentSpec(
        name="embedding_projections",
        title="Embedding: projections",
        settings=Embedding,
        order=80,
        of_embedding=True,
        paper="embedding",
    ),
    ExperimentSpec(
        name="embedding_knn",
        title="Embedding: nearest neighbours",
        settings=Embedding,
        order=81,
        of_embedding=True,
        paper="latent-knn",
    ),
    ExperimentSpec(
        name="embedding_distances",
        title="Embedding: distances",
        settings=Embedding,
        order=82,
        of_embedding=True,
        paper="distances",
    ),
)
#: Specifications by name.
BUILT_IN = {spec.name: spec for spec in _SPECS}
