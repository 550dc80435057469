"""Description of a published model: task, scores with intervals, settings and provenance."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from markupsafe import Markup

from ajgdata.paths import Paths
from ajgdata.report.card import cell
from ajgdata.report.format import DASH, number
from ajgdata.report.render import environment


class ModelScore(NamedTuple):
    """A metric of one split of the cross-validation; NaN is unknown.

    `low` and `high` are the ends of the 95 % interval over grasps.
    """

    split: str
    test_set: str
    target_values: str
    metric: str
    unit: str
    mean: float
    sd: float
    low: float
    high: float
    chance: float


@dataclass(frozen=True)
class ModelCard:
    """Values of the template of a model's description. Texts are not escaped."""

    title: str
    dataset: str
    task: str
    model: str
    facts: Sequence[tuple[str, str]]
    scores: Sequence[Mapping[str, str]]
    has_interval: bool
    arguments: Markup  #: of `predict_file`, as Python code


def render_model_card(
    about: Mapping[str, Any],
    scores: Sequence[ModelScore],
    facts: Mapping[str, str],
    label: str,
    project: Paths,
) -> str:
    """Return README.md of a published model.

    `about` is the content of its model.json, `label` its name for people, and `facts` are further
    facts of its data set by topic.
    """
    templates = environment(project)
    templates.keep_trailing_newline = True
    templates.filters["cell"] = cell
    dataset = about["provenance"]["data_set"]
    task = about["task"]
    card = ModelCard(
        title=f"{label} for {task} of {dataset}",
        dataset=dataset,
        task=task,
        model=about["model"],
        facts=[*_facts(about).items(), *facts.items()],
        scores=[_cells(score) for score in scores],
        has_interval=any(math.isfinite(score.low) for score in scores),
        arguments=Markup(_arguments(about)),
    )
    return templates.get_template("model_card.md.j2").render(card=card)


def _facts(about: Mapping[str, Any]) -> dict[str, str]:
    """Return facts about a model by topic."""
    predicts = about["target"]
    if about["unit"]:
        predicts += f" in {about['unit']}"
    provenance = about["provenance"]
    facts = {
        "predicts": f"{predicts} ({about['kind']})",
        "classes": ", ".join(map(str, about["classes"])),
        "model": about["model"],
        "tuned settings": about.get("tuning", {}).get("choice", ""),
        "trained on": f"{about['recordings']} recordings, {provenance['source']}",
        "audio": _settings(about["audio"]),
        "feature": _settings(about["features"]),
        "covariates": ", ".join(map(_covariate, about.get("covariates", ()))),
        "seed": str(about["seed"]),
        "features computed by": f"ajgdata {provenance['ajgdata_version']}, commit "
        f"{provenance['git_commit'] or DASH}",
        "digest of the recordings": provenance["inputs_sha256"],
    }
    return {topic: text for topic, text in facts.items() if text}


def _arguments(about: Mapping[str, Any]) -> str:
    """Return example arguments of `predict_file` for a model: the file, and its covariates."""
    values = [f'"{covariate["name"]}": …' for covariate in about.get("covariates", ())]
    if not values:
        return '"recording.wav"'
    return f'"recording.wav", covariates={{{", ".join(values)}}}'


def _covariate(covariate: Mapping[str, Any]) -> str:
    """Return a covariate with its unit and the range of its training values."""
    unit = f" {covariate['unit']}" if covariate["unit"] else ""
    return f"{covariate['name']} ({covariate['least']:g} to {covariate['largest']:g}{unit})"


def _settings(settings: Mapping[str, Any]) -> str:
    """Return settings on one line, as JSON values."""
    return ", ".join(f"{key} {json.dumps(value)}" for key, value in settings.items())


def _cells(score: ModelScore) -> dict[str, str]:
    """Return the cells of a score, by column."""
    unit = f" {score.unit}" if score.unit else ""
    spread = f" ± {number(score.sd)}" if math.isfinite(score.sd) else ""
    has_interval = math.isfinite(score.low)
    return {
        "split": score.split,
        "test_set": score.test_set,
        "target_values": score.target_values,
        "metric": score.metric,
        "value": f"{number(score.mean)}{spread}{unit}",
        "interval": f"{number(score.low)} to {number(score.high)}{unit}" if has_interval else DASH,
        "chance": f"{number(score.chance)}{unit}" if math.isfinite(score.chance) else DASH,
    }
