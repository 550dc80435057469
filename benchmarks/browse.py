"""Measure `ajgdata browse` with 50,000 recordings, as ratios to 500.

    python benchmarks/browse.py [--sizes 500 50000] [--repeats 5]

Each size has a temporary project with labels, features and predictions of random numbers; there are
no sounds. The times are those of the requests of a page: start and first table (all tables are
read), a filter, an order, the rows of one screen, and the map with novelty.
"""

from __future__ import annotations

import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
import yaml

from ajgdata.browse.view import View
from ajgdata.paths import Paths
from ajgdata.store.feature_array import frequency_axis
from ajgdata.store.features import FeatureRows, text_column, write_store
from ajgdata.store.findings import write_findings
from ajgdata.store.sessions import write_session
from ajgdata.store.tables import write_measurements
from ajgdata.types import Recording, Session
from ajgdata.types.table import table_of

NAME = "many"
BINS = 1025
CLASSES = [f"object {number}" for number in range(16)]
PER_SESSION = 500
PER_GRASP = 10
#: Rows of one screen.
SCREEN = 60


def make_project(paths: Paths, count: int) -> None:
    """Write a data set of `count` recordings, the results of its features and predictions."""
    generator = np.random.default_rng(0)
    labels = [CLASSES[(number // PER_GRASP) % len(CLASSES)] for number in range(count)]
    names = []
    for start in range(0, count, PER_SESSION):
        session = f"s{start // PER_SESSION:03}"
        rows = [
            Recording(
                recording_id=f"r{number:06}",
                file=f"audio/{number:06}.wav",
                grasp_id=f"g{number // PER_GRASP}",
                object=labels[number],
                labels={"material": labels[number], "angle_deg": f"{number % 90}"},
            )
            for number in range(start, min(count, start + PER_SESSION))
        ]
        write_session(
            paths.session(NAME, session), Session(session_id=session, source="import"), rows
        )
        names += [f"{session}/{row.recording_id}" for row in rows]
    declaration = {
        "name": NAME,
        "targets": {"material": {"kind": "classification"}, "angle_deg": {"kind": "regression"}},
        "tasks": {"material": {"target": "material", "models": ["knn"]}},
    }
    paths.dataset(NAME).parent.mkdir(parents=True)
    paths.dataset(NAME).write_text(yaml.safe_dump(declaration), encoding="utf-8")
    features = generator.random((count, BINS), np.float32)
    columns = {"recording": text_column(names)}
    axis = frequency_axis(np.arange(BINS) * 21.5)
    write_store(paths.features(NAME), FeatureRows(features, (axis,), columns, {}))
    write_findings(paths.quarantine(NAME), [])
    predicted = generator.choice(CLASSES, count)
    rows = [
        {
            "recording": name,
            "split": "grouped",
            "test_set": NAME,
            "target_values": "training",
            "fold": 0,
            "y_true": label,
            "y_pred": str(prediction),
            "probability": float(probability),
        }
        for name, label, prediction, probability in zip(
            names, labels, predicted, generator.random(count), strict=True
        )
    ]
    table = table_of("predictions", "Predictions", rows, **{key: key for key in rows[0]})
    about = {"dataset": NAME, "task": "material", "model": "knn"}
    write_measurements(
        paths.experiment(NAME, "material", "cross_validation", "plain"), [(about, [table])]
    )


def seconds(action: Callable[[], object]) -> float:
    """Return the wall time of an action."""
    begin = time.perf_counter()
    action()
    return time.perf_counter() - begin


def measure(paths: Paths, repeats: int) -> dict[str, float]:
    """Return the seconds of each request; repeated requests have the median."""
    view = View(paths, NAME)
    table = view.table("", "", "", "")
    filters = ["material=object wrong=yes", "confidence>0.9", "r00012"]
    times = {
        "start and first table": seconds(lambda: View(paths, NAME).table("", "", "", "")),
        "map and novelty": seconds(lambda: view.points("", "")),
    }
    view.table("", "", "object", "recording")  # numbers of texts are computed once
    repeated: dict[str, Callable[[], object]] = {
        'filter `label="object 3" wrong=yes`': lambda: view.table(
            "", "", 'label="object 3" wrong=yes', ""
        ),
        "filter `confidence>0.9`": lambda: view.table("", "", filters[1], ""),
        "filter `r00012` (any text)": lambda: view.table("", "", filters[2], ""),
        "order by confidence": lambda: view.table("", "", "", "-confidence"),
        "rows of a screen": lambda: view.rows("", "", table["order"][:SCREEN]),
    }
    for name, action in repeated.items():
        times[name] = statistics.median(seconds(action) for _ in range(repeats))
    return times


def main(
    sizes: Annotated[list[int] | None, typer.Option(help="numbers of recordings")] = None,
    repeats: Annotated[int, typer.Option(help="repeats of each filter")] = 5,
) -> None:
    """Print a table in Markdown: the seconds of the first size, and ratios of the others to it."""
    results = {}
    for size in sizes or [500, 50_000]:
        with tempfile.TemporaryDirectory() as folder:
            paths = Paths(Path(folder))
            make_project(paths, size)
            results[size] = measure(paths, repeats)
    first, *others = results
    heads = [f"{first:,}", *(f"{size:,}, ratio to {first}" for size in others)]
    print(f"| request | {' | '.join(heads)} |\n|{' --- |' * (1 + len(heads))}")
    for name, base in results[first].items():
        cells = [f"{1000 * base:.1f} ms"]
        for size in others:
            value = results[size][name]
            cells.append(f"{value / base:.0f} ({1000 * value:.0f} ms)")
        print(f"| {name} | {' | '.join(cells)} |")


if __name__ == "__main__":
    typer.run(main)
