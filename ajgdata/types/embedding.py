"""Embeddings of a data set as declared: which pairs are similar, and what is asked of the space."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from ajgdata.types.base import Distinct, Strict

Dimension = Annotated[int, Field(ge=1, le=256)]


class Embedding(Strict):
    """Contrastive embedding (Hadsell, Chopra, LeCun 2006). No setting is tuned to a data set."""

    instance: str = Field(
        "object",
        description="column of the acquisition log that says which physical thing was recorded: two"
        " recordings of one are similar if their grasps differ, of two are dissimilar",
    )
    supervision: str = Field(
        min_length=1, description="what this pair rule had to know, in a sentence for the report"
    )
    groups: str = Field("grasp_id", description="column whose values never straddle folds")
    folds: int = Field(5, ge=2, description="of the cross-validation")
    inits: int = Field(2, ge=1, description="initialisations of each fold's network")
    dimensions: Annotated[tuple[Dimension, ...], Distinct] = Field(
        (2, 3, 4, 6, 8, 12, 16, 32, 64), min_length=1, description="of the latent, for k-NN"
    )
    shown: Dimension = Field(8, description="dimension of what is measured further (paper: 8)")
    most_recordings: int = Field(
        2000,
        ge=100,
        description="recordings that it is made of and measured on at most, evenly of all grasps:"
        " its networks alone take two minutes of a core for each thousand",
    )
    margin: float = Field(1.0, gt=0, description="distance beyond which dissimilar pairs rest")
    epochs: int = Field(
        15, ge=1, description="passes over the training recordings; the loss has vanished by then"
    )
    batch_instances: int = Field(8, ge=2, description="things in a batch")
    batch_recordings: int = Field(4, ge=2, description="recordings of each of them in a batch")
    target: str = Field(description="target that k-NN is scored on")
    category: str = Field("", description="classes of the distance matrix; default: `target`")
    optional: bool = Field(
        False, description="what the data lack for it is told, and the run succeeds all the same"
    )

    @model_validator(mode="after")
    def _consistent(self) -> Embedding:
        if self.shown not in self.dimensions:
            raise ValueError(f"shown {self.shown} is not among the dimensions")
        return self
