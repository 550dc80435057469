"""`ajgdata compare` on two real runs: a setting of the features is changed, and the run redone."""

import shutil
from pathlib import Path

import pytest
import yaml
from conftest import DECLARATION

from ajgdata.pipeline.compare import compare_runs
from ajgdata.store.files import read_csv
from ajgdata.store.runs import kept_runs


def pooled(results: Path) -> float:
    """The accuracy over all recordings, as the table of numbers has it."""
    (row,) = [
        row
        for row in read_csv(results / "metrics.csv")[1]
        if (row["metric"], row["statistic"], row["part"]) == ("accuracy", "pooled", "grouped")
    ]
    return float(row["value"])


def test_a_changed_setting_is_what_differs(project, tmp_path):
    project.snakemake("results/metrics.json")
    before = tmp_path / "before"
    shutil.copytree(project.root / "results", before)
    assert compare_runs(str(before), str(project.root)).same
    kept = kept_runs(project.paths)
    assert len(kept) <= 1  # none without git
    for one in kept:
        assert compare_runs(str(one.folder), str(before)).same

    changed = DECLARATION | {"features": {"band_hz": [4000, 9000]}}  # above both pitches
    project.paths.dataset("tones").write_text(yaml.safe_dump(changed))
    project.snakemake("results/metrics.json")
    found = compare_runs(str(before), str(project.root))
    assert not found.same and len(kept_runs(project.paths)) == 2 * len(kept)
    accuracy = next(one for one in found.numbers.changed if one.key.metric == "accuracy")
    assert accuracy.paired  # the same recordings, hence the same folds
    (flipped,) = found.flips
    assert flipped.both == 16 and flipped.changed == flipped.lost + flipped.gained > 0
    gain = pooled(project.root / "results") - pooled(before)
    assert flipped.gained - flipped.lost == pytest.approx(16 * gain, abs=1e-9)
    (band,) = [one for one in found.settings if one.key.endswith("band_hz")]
    assert (band.a, band.b, band.where) == ("null", "[4000.0, 9000.0]", ("data set tones",))
    assert {one.key.model for one in found.numbers.costs} == {"knn"}
