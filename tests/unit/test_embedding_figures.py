"""What is shown of embeddings, from stored results to the drawn figure."""

import dataclasses

import numpy as np
import pytest
from drawn_figures import texts
from embedding_samples import SCRIPT, distances, figures, pictures, results
from matplotlib.colors import to_hex

from ajgdata.experiments import EXPERIMENTS, embedding_projections
from ajgdata.experiments.embedding_distances import categories_of
from ajgdata.report.canvas import COLOURS, draw
from ajgdata.report.projections import (
    category_colours,
    shown_columns,
    text_colours,
)


@pytest.mark.parametrize(
    ("kind", "name", "expected"),
    [
        ("embedding_knn", "", "k-NN reaches 55 ± 14 % on a latent of 4 dimensions, 50 ± 14 % on "
         "raw features (chance 25 %)"),
        ("embedding_distances", "", "Categories whose members lie nearer to one another "
         "than to others: 2 of 3 in latent, 2 of 3 in raw features"),
        ("embedding_projections", "silhouettes", "Lowest silhouette"),
    ],
)  # fmt: skip
def test_captions_say_whose_results_and_which(kind, name, expected):
    shown = figures(results(kind, source="recorded"))[name]
    assert shown.caption.text.startswith("Things · poses, recorded. ")
    if kind != "embedding_projections":
        assert shown.caption.alt.startswith(expected)


def test_categories_keep_their_colours_and_others_get_further_ones():
    found = category_colours(np.array(["zinc", "other", "spherical", "", "other"]))
    assert list(found) == ["spherical", "other", "", "zinc"]
    assert found["spherical"] == COLOURS[0] and found["other"] == COLOURS[2]
    assert len(set(found.values())) == 4


def test_gaps_are_to_the_mean_of_the_others():
    within = {"cylindrical": 1, "other": 2, "spherical": 1}
    one = results("embedding_distances", distances(within, narrower=0.1))
    found = categories_of(one, "latent")
    assert found["spherical"].gap.mean == pytest.approx(2)
    assert found["cylindrical"].gap.mean == pytest.approx(2.05)
    assert found["cylindrical"].gap.sd == pytest.approx(0.1 / 2**0.5)


def test_accuracy_is_drawn_against_dimension():
    (axes,) = draw(figures(results("embedding_knn"))[""]).axes
    bars = {c.get_label(): c.lines[0].get_xydata() for c in axes.containers}
    np.testing.assert_allclose(bars["latent"], [[2, 50], [4, 55]])
    np.testing.assert_allclose(bars["PCA"], [[2, 30], [4, 35]])
    np.testing.assert_allclose(bars["raw features"], [[2, 50], [4, 50]])


def test_columns_that_tell_nothing_or_too_much_are_not_coloured():
    shown = pictures()
    more = {"same": np.array(["a"] * 32), "nan": np.full(32, np.nan), "one": np.ones(32)}
    more |= {"id": np.array([f"r{i}" for i in range(32)])}
    assert shown_columns(dataclasses.replace(shown, columns={**shown.columns, **more})) == [
        "object", "category", "angle_deg", "session_id",
    ]  # fmt: skip


def test_each_space_and_method_has_its_panel_with_its_points():
    shown = pictures()
    figure = draw(figures(results("embedding_projections"))["by-category"])
    assert "simulated" in texts(figure)
    panels = {axes.get_title(): axes for axes in figure.axes if axes.get_title()}
    expected = [f"{s} · {m}" for s in ("latent", "raw features") for m in ("PCA", "UMAP", "t-SNE")]
    assert sorted(panels) == sorted([*expected, "latent · 2-D"])
    umap = next(p for p in shown.projections if (p.space, p.method) == ("raw", "umap"))
    colours, category = text_colours(shown.columns["category"]), shown.columns["category"]
    drawn = panels["raw features · UMAP"].collections
    for index, name in enumerate(colours):
        filled, rings = drawn[2 * index : 2 * index + 2]
        own = category == name
        np.testing.assert_array_equal(filled.get_offsets(), umap.points[own & shown.training])
        np.testing.assert_array_equal(rings.get_offsets(), umap.points[own & ~shown.training])
        assert to_hex(rings.get_edgecolors()[0]) == to_hex(colours[name])


def test_it_is_said_what_the_pairs_had_to_know_and_how_many_recordings_were_used():
    one = results("embedding_projections", about={"recordings": 40, "available": 7200})
    assert EXPERIMENTS["embedding_projections"].summary(one) == (
        f"What the pairs are made from: Which things are the same, and {SCRIPT}. "
        "Recordings used: 40 of 7,200."
    )


def test_stored_projections_are_what_they_were():
    tables = results("embedding_projections").results[0].tables
    found, shown = embedding_projections.projections_of(tables), pictures()
    assert found.recording.tolist() == shown.recording.tolist()
    assert found.training.tolist() == shown.training.tolist()
    np.testing.assert_array_equal(found.columns["angle_deg"], shown.columns["angle_deg"])
    for a, b in zip(found.projections, shown.projections, strict=True):
        assert (a.space, a.method) == (b.space, b.method)
        np.testing.assert_array_equal(a.points, b.points)
