"""The page on features has the numbers of its file, and its claims follow from them."""

import json

import pytest

from tools.feature_page import (
    FIGURE,
    PAGE,
    RESULTS,
    TITLE,
    family_gains,
    fold_gains,
    page_with_tables,
)


@pytest.fixture(scope="module")
def results():
    return json.loads(RESULTS.read_text(encoding="utf-8"))


def test_the_tables_are_those_of_the_measured_numbers(results):
    text = PAGE.read_text(encoding="utf-8")
    assert page_with_tables(text, results) == text


def test_the_advice_follows_from_the_verdicts(results):
    text = PAGE.read_text(encoding="utf-8")
    assert text.startswith(f"# {TITLE}\n")
    gains = fold_gains(results["scores"])
    assert f"in any of {len(gains)} comparisons" in text
    means = family_gains(results["scores"])
    verdicts = [gain.verdict for gain in gains.values()]
    assert "better" not in [*verdicts, *(gain.verdict for _, gain in means.values())]
    worse = [key for key, gain in gains.items() if gain.verdict == "worse"]
    named = [(results["scores"][row]["dataset"], feature) for row, feature in worse]
    assert named == [("knock_material", "spectrogram")]
    for (family, feature), (_, gain) in means.items():
        if family.source == "simulated" and feature != "spectrogram":
            assert gain.verdict == "no difference"
        if family.source == "recorded":
            assert gain.verdict == "inconclusive"


def test_the_figure_has_both_sources():
    picture = FIGURE.read_text(encoding="utf-8")
    assert len(picture) < 300_000
    assert all(f"<!-- {source} -->" in picture for source in ("recorded", "simulated"))
