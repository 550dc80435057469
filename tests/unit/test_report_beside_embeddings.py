"""Embeddings and other grippers beside the paper: numbers and verdicts computed from documents."""

import dataclasses
import math

import embedding_samples
import numpy as np
import pytest
from ajgdata.pipeline.embed_documents import embedded
from ajgdata.report.beside import absent, beside
from ajgdata.report.further import About, TransferLine, Transfers
from ajgdata.report.illustrations import illustrations
from report_samples import COST, regression_result, sample_report

from ajgdata.report.comparison import HIGHER, LOWER, PARTLY, UNCLEAR, YES, Spent, holds, together
from ajgdata.report.format import Score
from ajgdata.report.page import render_page
from ajgdata.report.paper import PaperFigure

VALUES = {"latent-knn": 26.6, "distances": None, "embedding": None, "transfer": None}
PAPER = tuple(
    PaperFigure(id=name, metric="", value=value, unit="", text="as told", where=f"where {name}")
    for name, value in VALUES.items()
)


def report_on(one, transfers=(), named=True):
    """The small report, of whose data sets `d` stands beside the paper."""
    report = sample_report()
    results = report.results
    if named:
        own = next(summary for summary in report.datasets if summary.name == "size")
        report = dataclasses.replace(
            report, datasets=(*report.datasets, dataclasses.replace(own, name="d"))
        )
        sized = PAPER[0].model_copy(update={"id": "size"})
        results = (*results, regression_result(dataset="d", paper=sized))
    return dataclasses.replace(
        report, results=results, paper=PAPER, embeddings=(one,), transfers=transfers
    )


def rows(one, **more):
    found = beside(report_on(one, **more))
    return {row.paper.id: row for row in found if row.dataset == "d"}


def made(**documents):
    """The small embedding, some of its documents replaced."""
    told = embedding_samples.documents() | documents
    pictures = embedding_samples.pictures()
    return embedded(embedding_samples.declared(), "poses", "simulated", told, pictures)


@pytest.mark.parametrize(
    ("gap", "said"),
    [(Score(1.0, 0.4), YES), (Score(-1.0, 0.4), "no"), (Score(1.0, 0.6), UNCLEAR),
     (Score(1.0, math.nan), YES)],
)  # fmt: skip
def test_a_difference_holds_beyond_two_standard_deviations(gap, said):
    assert holds(gap, "no") == said


def test_statements_on_several_things():
    assert together([YES, YES]) == YES
    assert together([YES, "no", YES]) == PARTLY
    assert together(["no: b", "no: a", "no: a"]) == "no: a; no: b"


@pytest.mark.parametrize(
    ("runs", "told", "agrees"),
    [
        # raw: 0.4 and 0.6 in two folds; each has one initialisation, so gains are 0.1 and 0.16
        ([0.5, 0.76], "26.0 ± 8.5 % higher", YES),
        ([0.45, 0.66], "11.0 ± 1.4 % higher", LOWER),
        ([0.8, 0.98], "78.0 ± 2.8 % higher", HIGHER),
        # two initialisations a fold: 0.1 and 0.2 in the first, 0.1 and 0.2 in the second
        ([0.5, 0.6, 0.7, 0.8], "30 ± 12 % higher", YES),
    ],
)
def test_the_gain_is_that_of_each_run_over_its_fold(runs, told, agrees):
    document = embedding_samples.knn()
    best = next(r for r in document["rows"] if (r["space"], r["dimension"]) == ("latent", 4))
    mean = float(np.mean(runs))
    best |= {"mean": mean, "sd": float(np.std(runs, ddof=1)), "per_run": runs}
    row = rows(made(knn={**document, "provenance": embedding_samples.PROVENANCE}))["latent-knn"]
    assert row.result.startswith(f"{told} (")
    assert f"{100 * (mean - 0.5):.3g} percentage points), best at 4 dimensions" in row.result
    assert row.agrees == agrees
    # two folds of 4 s; 0.03 s for 20 recordings
    assert row.cost == Spent(8.0, pytest.approx(1.5))


def distances(**within):
    """Validation distances of two runs, 0.01 off their mean; 3 between all categories."""
    document = embedding_samples.distances()
    for one in document["spaces"].values():
        mean = np.full((3, 3), 3.0)
        np.fill_diagonal(mean, [within[name] for name in one["categories"]])
        one |= {"mean": mean.tolist(), "per_run": [(mean - 0.01).tolist(), (mean + 0.01).tolist()]}
        one["per_run"][0][0][0] -= 0.1  # of cylindrical, so that its gap has a spread
    return document | {"provenance": embedding_samples.PROVENANCE}


@pytest.mark.parametrize(
    ("within", "agrees"),
    [
        ({"cylindrical": 1, "other": 2.5, "spherical": 1}, YES),
        ({"cylindrical": 1, "other": 0.5, "spherical": 1}, PARTLY),  # other is the narrowest
        ({"cylindrical": 4, "other": 5, "spherical": 1}, PARTLY),
        (
            {"cylindrical": 4, "other": 2, "spherical": 4},
            "no: not nearer within; no: not the widest",
        ),
    ],
)
def test_categories_lie_together_or_do_not(within, agrees):
    row = rows(made(distances=distances(**within)))["distances"]
    assert row.agrees == agrees
    assert f"spherical {within['spherical']} within" in row.result
    assert row.cost == Spent(8.0, pytest.approx(1.5))


def test_gaps_are_to_the_mean_of_the_others():
    (latent, _) = made(distances=distances(cylindrical=1, other=2, spherical=1)).distances
    gaps = latent.gaps()
    assert gaps["spherical"].mean == pytest.approx(2)
    assert gaps["cylindrical"].mean == pytest.approx(2.05)
    assert gaps["cylindrical"].sd == pytest.approx(0.1 / 2**0.5)


def test_clusters_are_told_by_the_silhouette():
    row = rows(made())["embedding"]
    assert row.result.startswith("silhouette of objects 0.30 ± 0.14 (raw features -0.10 ± 0.14)")
    assert "in two dimensions, of the validation points" in row.result
    assert row.agrees == YES


@pytest.mark.parametrize(
    ("brought", "agrees"), [(0.1, YES), (0.45, UNCLEAR), (0.9, "no: it works")]
)
def test_an_encoder_on_grippers_that_it_never_saw(brought, agrees):
    """With 4 own grasps alone it reaches 0.5 there, with a deviation of 0.14."""
    document = embedding_samples.transfer()
    for part in ("rows", "within"):
        document[part] += [
            {**row, "space": "pose_latent"} for row in document[part] if row["space"] == "raw"
        ]
    for row in document["rows"]:
        if row["space"] == "pose_latent":
            row.update(embedding_samples.score(brought, 0.05))
    told = {
        "transfer": {**document, "provenance": embedding_samples.PROVENANCE},
        "transfer_cost": {"cpu_s": 30.0},
    }
    spec = embedding_samples.declared(base="size", held_out=["tall"])
    row = rows(embedded(spec, "poses", "simulated", told, None))["transfer"]
    assert row.agrees == agrees
    best = "latent across grippers, 40 %" if brought < 0.4 else f"pose latent, {100 * brought:g} %"
    assert row.result.endswith(best)
    assert row.cost.train_s == 30


def test_embeddings_of_other_things_do_not_stand_beside_the_paper():
    assert rows(made(), named=False) == {}
    assert {one.id for one in absent(report_on(made(), named=False))} == set(VALUES)


@pytest.mark.parametrize(("there", "agrees"), [(9.0, YES), (1.5, "no: it works")])
def test_a_model_on_other_grippers_without_calibration(there, agrees):
    """At home the RMSE is 2 mm with a deviation of 0.2; more is worse."""
    lines = tuple(
        TransferLine(
            model, dataset, f"Gripper {dataset}", np.array([0, 4]), np.array([there, 2.0]),
            np.array([0.5, 0.1]), (2.0, 0.2), 8.0,
        )
        for dataset in ("a", "b")
        for model in ("CNN", "k-NN")
    )  # fmt: skip
    about = About("size", "edge", "Sizes", "simulated")
    transfers = Transfers(about, "rmse", "mm", 5, lines, PAPER[3])
    report = report_on(made(), transfers=(transfers,))
    (row,) = [row for row in beside(report) if row.paper.id == "transfer"]
    assert (row.model, row.agrees, row.cost) == ("CNN", agrees, COST)
    assert row.result.startswith("2.00 ± 0.20 mm where it was trained, ")
    assert row.result.count("Gripper") == 2


def test_every_data_set_has_its_own_row_and_the_page_shows_them():
    report = report_on(made())
    size = dataclasses.replace(report.results[0], paper=PAPER[1])
    report = dataclasses.replace(report, results=(size, *report.results[1:]))
    order = [(row.paper.id, row.dataset) for row in beside(report)]
    assert [name for name, _ in order] == [
        "latent-knn",
        "distances",
        "distances",
        "embedding",
        "size",
    ]
    assert {("distances", "d"), ("distances", "size")} < set(order)
    html = render_page(report, {name: b"<svg/>" for name in illustrations(report)})
    assert "silhouette of objects 0.30 ± 0.14" in html
