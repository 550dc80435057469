"""Diagnosis of a task of own data: does the model recognise the object or the placement?"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from ajgdata.evaluate.diagnosis import (
    ENOUGH_SESSIONS,
    DiagnosisVerdict,
    diagnose,
    kept_skill,
    over_sessions,
)
from ajgdata.evaluate.next_session import next_session
from ajgdata.evaluate.parts import GROUPED, RANDOM, SESSIONS
from ajgdata.experiments.base import TaskResults
from ajgdata.experiments.cross_validation_results import ModelResult, design_of, shown_model
from ajgdata.report.format import Caption, Score, number, sentence, with_unit
from ajgdata.report.marks import FigureContent, Point, draw
from ajgdata.report.report_data import Diagnosis, Illustration, PlanRow
from ajgdata.types.table import table_of

KEPT = "of its advantage over guessing in a new session."
ANSWERS: dict[DiagnosisVerdict, str] = {
    "object": f"The object: the model keeps {{share}} {KEPT}",
    "placement": f"The placement: the model keeps only {{share}} {KEPT}",
    "nothing": "Neither: the model is not better than chance on new grasps.",
    "inconclusive": f"Inconclusive: the model keeps {{share}} {KEPT}",
    "unmeasured": "Unknown: all grasps are from one session.",
}
ADVICE: dict[DiagnosisVerdict, str] = {
    "object": "Record more grasps of labels that the model confuses.",
    "placement": "Record more placements and sessions, not more grasps.",
    "nothing": "Check the recordings first (ajgdata check), and listen to them. Then record a new"
    " session.",
    "inconclusive": "Record a new session on another day.",
    "unmeasured": "Record a second session on another day.",
}
CAPTION = (
    "Scores with 95 % intervals over grasps. Known sessions: other grasps of the same sessions are"
    " in the training data. New sessions: the complete session is held out. Dotted: nominal chance."
)
PLACEBO_CAPTION = (
    " Placebo: one object under the names of all classes, which shows the real chance level."
)


def diagnosis(results: TaskResults, link: Callable[[str], str]) -> Diagnosis:
    """Return the diagnosis of a task; `link` returns the link to a recording, or ""."""
    model = shown_model(results)
    new = None
    n_sessions = 0
    if model.has(SESSIONS):
        n_sessions = len(model.folds(SESSIONS))
        new = over_sessions(model.estimate(SESSIONS), model.folds(SESSIONS), results.metric)
    own = model.estimate()
    placebo_score = model.placebo()
    placebo_part = model.placebo_part(GROUPED)
    placebo = model.estimate(placebo_part) if placebo_score is not None else None
    verdict = diagnose(own, new, placebo)
    answer = ANSWERS[verdict]
    if new is not None and "{share}" in answer:
        shares = [max(100 * value, 0.0) for value in kept_skill(own, new)]
        share, low, high = (number(value, 2) for value in shares)
        answer = answer.format(share=f"{share} % ({low} to {high})")
    explanation = _explanation(model)
    if verdict in ("object", "placement") and n_sessions < ENOUGH_SESSIONS:
        answer = f"Preliminary. {answer}"
        explanation += (
            f" The interval counts grasps of {n_sessions} sessions; another session can differ."
            f" From {ENOUGH_SESSIONS} sessions on, it has the variation between sessions."
        )
    name = f"{results.dataset}--{results.task}--diagnosis"
    sounds, sounds_text = _sounds(model, link)
    plan = _plan(results, model)
    advice = ADVICE[verdict]
    if verdict == "object" and n_sessions < ENOUGH_SESSIONS:
        advice += " Record a new session, too: with five or more, the answer is not preliminary."
    if plan:
        advice += " The plan of the next session is below."
    elif verdict != "nothing":
        advice += " In a session, place each object twice, in random order."
    columns = {"step": "Step", "label": "Object", "placement": "Placement", "grasps": "Grasps"}
    return Diagnosis(
        title=results.title,
        source=results.source,
        answer=answer,
        explanation=explanation,
        figure=_figure(name, model, answer),
        sounds=sounds,
        sounds_text=sounds_text,
        advice=advice,
        plan=plan,
        plan_table=table_of(
            f"next-session--{results.dataset}--{results.task}",
            "Plan of the next session",
            [row._asdict() for row in plan],
            **columns,
        ),
    )


def _explanation(model: ModelResult) -> str:
    """Return the scores in words, and the problem of the design."""
    task = model.task
    own = _score_text(task, model.with_interval())
    texts = [f"{task.metric_title} {own} on new grasps of known sessions"]
    sessions = model.in_sessions()
    if sessions is not None:
        texts.append(f"{_score_text(task, sessions)} in new sessions")
    placebo = model.placebo()
    if placebo is not None:
        texts.append(f"{_score_text(task, placebo)} for the placebo")
    chance = with_unit(number(task.scale * model.chance()), task.shown_unit)
    explanation = f"{model.label}: {', '.join(texts)} (chance level {chance})."
    design = design_of(model.task)
    if design is not None and design.problem:
        explanation += f" {sentence(design.problem)}."
    return explanation


def _score_text(task: TaskResults, score: Score) -> str:
    """Return a score as it is shown, with the ends of its interval: `70 % (59.5 to 80)`."""
    text = with_unit(number(task.scale * score.mean), task.shown_unit)
    if not score.has_interval:
        return text
    return f"{text} ({number(task.scale * score.low)} to {number(task.scale * score.high)})"


def _figure(name: str, model: ModelResult, title: str) -> Illustration:
    """Return the figure: one row per kind of test, with chance level."""
    scores = {
        "same grasps": model.with_interval(RANDOM) if model.has(RANDOM) else None,
        "known sessions, new grasps": model.with_interval(),
        "new sessions": model.in_sessions(),
        "placebo": model.placebo(),
    }
    scale = model.task.scale
    points = tuple(
        Point("", model.label, place, _scaled(score, scale))
        for place, score in scores.items()
        if score is not None
    )
    is_share = model.task.shown_unit == "%"
    content = FigureContent(
        title=title.rstrip("."),
        subtitle=f"{model.task.title}, {model.label}",
        sources=(model.task.source,),
        points=points,
        axis=(model.task.metric_title, model.task.shown_unit),
        chance=(("", scale * model.chance()),),
        limits=(0.0, 100.0) if is_share else (0.0, float("inf")),
    )
    listed = "; ".join(f"{point.x}: {number(point.score.mean, 3)}" for point in points)
    text = CAPTION if scores["placebo"] is None else CAPTION + PLACEBO_CAPTION
    caption = Caption(text, f"{title} {listed}.")
    return Illustration(name, caption, partial(draw, "rows", content), content.title)


def _scaled(score: Score, scale: float) -> Score:
    """Return a score in the unit in which it is shown."""
    return Score(scale * score.mean, scale * score.sd, (), scale * score.low, scale * score.high)


def _sounds(
    model: ModelResult, link: Callable[[str], str]
) -> tuple[tuple[tuple[str, str], ...], str]:
    """Return two recordings to compare, with links, and what to listen for; nothing without links.

    The first one is the most certain wrong prediction, in a new session if there is one. The second
    one is the clearest recording of the predicted class.
    """
    if model.task.task_settings.kind != "classification":
        return (), ""
    part = SESSIONS if model.has(SESSIONS) else GROUPED
    true, predicted = model.predictions(part)
    recordings = model.recordings(part)
    confidence = np.nan_to_num(model.confidence(part))
    wrong = np.flatnonzero(true != predicted)
    if not len(wrong):
        return (), ""
    first = int(wrong[np.argmax(confidence[wrong])])
    known_true, known_predicted = model.predictions()
    clear = np.flatnonzero((known_true == known_predicted) & (known_true == predicted[first]))
    if not len(clear):
        return (), ""
    second = int(clear[np.argmax(np.nan_to_num(model.confidence())[clear])])
    sounds = (
        (f"{true[first]}, predicted as {predicted[first]}", link(recordings[first])),
        (f"{predicted[first]}, predicted correctly", link(model.recordings()[second])),
    )
    if not all(address for _, address in sounds):
        return (), ""
    place = " in a new session" if part == SESSIONS else ""
    text = (
        f"The first recording is the most certain wrong prediction{place}. The second one is of the"
        " class that the model predicted. If you hear the difference, the class is in the sound,"
        " and the model needs more placements to find it."
    )
    return sounds, text


def _plan(results: TaskResults, model: ModelResult) -> tuple[PlanRow, ...]:
    """Return the plan of the next session; nothing for a target of numbers."""
    if results.task_settings.kind != "classification":
        return ()
    return tuple(PlanRow(*placement) for placement in next_session(model.classes))
