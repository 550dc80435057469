"""What the figures on embeddings show, read back from the drawn figure."""

import dataclasses

import numpy as np
import pytest
from drawn_figures import fits, smallest_pt, texts
from embedding_samples import (
    DIMENSIONS,
    SCRIPT,
    TABLES,
    distances,
    figures,
    pictures,
    results,
)
from matplotlib.colors import to_hex

from ajgdata.experiments import EXPERIMENTS, embedding_projections
from ajgdata.experiments.embedding_distances import distances_of
from ajgdata.report.canvas import COLOURS, draw
from ajgdata.report.projections import (
    MISSING,
    Projections,
    category_colours,
    shown_columns,
    text_colours,
)


@pytest.fixture(scope="module")
def drawn():
    """Every figure, by experiment and name."""
    listed = {kind: figures(results(kind)) for kind in TABLES}
    return {(k, name): draw(one) for k, some in listed.items() for name, one in some.items()}


def test_every_figure_says_simulated_and_fits(drawn):
    assert set(drawn) == {
        ("embedding_knn", ""),
        *(("embedding_distances", n) for n in ("categories", "different", "objects")),
        *(("embedding_projections", f"by-{name}") for name in shown_columns(pictures())),
    }
    for key, figure in drawn.items():
        assert "simulated" in texts(figure), key
        assert any(text.startswith("Things · poses: ") for text in texts(figure)), key
        assert fits(figure), key
        assert smallest_pt(figure) >= 7.8, key


def test_captions_say_whose_and_whether_it_is_simulated():
    for kind in TABLES:
        for one in figures(results(kind, source="recorded")).values():
            assert one.caption.text.startswith("Things · poses, recorded. ")
            assert one.caption.alt.endswith(" Things · poses, recorded.")


def test_titles_and_descriptions_say_the_result():
    for kind, name, expected in (
        ("embedding_knn", "", "k-NN reaches 55 ± 14 % on a latent of 4 dimensions, 50 ± 14 % on "
         "raw features (chance 25 %)"),
        ("embedding_distances", "categories", "Categories whose members lie nearer to one another "
         "than to others: 2 of 3 in latent, 2 of 3 in raw features"),
        ("embedding_projections", "by-object", "Silhouette of object: latent 0.30 ± 0.14, "
         "raw features -0.10 ± 0.14"),
    ):  # fmt: skip
        assert figures(results(kind))[name].caption.alt.startswith(expected)


def test_categories_keep_their_colours_and_others_get_further_ones():
    found = category_colours(np.array(["zinc", "other", "spherical", "", "other"]))
    assert list(found) == ["spherical", "other", "", "zinc"]
    assert found["spherical"] == COLOURS[0] and found["other"] == COLOURS[2]
    assert len(set(found.values())) == 4


def test_lengths_that_differ_are_refused():
    with pytest.raises(ValueError, match=r"lengths \[1, 2\]"):
        Projections(np.array(["a"]), np.array([True]), {"object": np.array(["a", "b"])}, ())


def test_categories_are_compared_with_the_mean_of_the_others(drawn):
    latent = distances_of(results("embedding_distances"))[0]
    assert latent.apart() == {"cylindrical": True, "other": False, "spherical": True}
    assert {"1.00\n± 0.10", "5.00\n± 0.10"} <= set(
        texts(drawn["embedding_distances", "categories"])
    )
    assert "—" in texts(drawn["embedding_distances", "different"])
    axes = drawn["embedding_distances", "objects"].axes[0]
    np.testing.assert_array_equal(axes.get_images()[0].get_array(), latent.object_mean)


def test_gaps_are_to_the_mean_of_the_others():
    within = {"cylindrical": 1, "other": 2, "spherical": 1}
    one = results("embedding_distances", distances(within, narrower=0.1))
    gaps = distances_of(one)[0].gaps()
    assert gaps["spherical"].mean == pytest.approx(2)
    assert gaps["cylindrical"].mean == pytest.approx(2.05)
    assert gaps["cylindrical"].sd == pytest.approx(0.1 / 2**0.5)


def test_accuracy_is_drawn_against_dimension(drawn):
    (axes,) = drawn["embedding_knn", ""].axes
    bars = {c.get_label(): c.lines[0].get_xydata() for c in axes.containers}
    np.testing.assert_allclose(bars["latent"], [[2, 50], [4, 55]])
    np.testing.assert_allclose(bars["PCA"], [[2, 30], [4, 35]])
    np.testing.assert_allclose(bars["raw features"], [[2, 50], [4, 50]])
    assert [t.get_text() for t in axes.get_xticklabels()] == [str(d) for d in DIMENSIONS]


def test_the_table_of_knn_has_the_times_and_says_what_pairs_are_made_from():
    accuracy, asked = EXPERIMENTS["embedding_knn"].tables(results("embedding_knn"))
    assert accuracy.rows[1][:3] == ("4", "55 ± 14 %; 4 s", "50 ± 14 %; 0.03 s")
    assert asked.rows[0] == (
        "what the pairs are made from", f"Which things are the same, and {SCRIPT}."
    )  # fmt: skip
    assert dict(asked.rows[1:])["dimensions"] == "2; 4"


def test_columns_that_tell_nothing_or_too_much_are_not_coloured():
    shown = pictures()
    more = {"same": np.array(["a"] * 32), "nan": np.full(32, np.nan), "one": np.ones(32)}
    many = {"id": np.array([f"r{i}" for i in range(64)])}
    assert shown_columns(dataclasses.replace(shown, columns={**shown.columns, **more})) == [
        "object", "category", "angle_deg", "session_id",
    ]  # fmt: skip
    wide = dataclasses.replace(pictures(64), columns=many)
    assert shown_columns(wide) == []


def test_each_space_and_method_has_its_panel_with_its_points(drawn):
    shown, figure = pictures(), drawn["embedding_projections", "by-category"]
    panels = {axes.get_title(): axes for axes in figure.axes if axes.get_title()}
    expected = [f"{s} · {m}" for s in ("latent", "raw features") for m in ("PCA", "UMAP", "t-SNE")]
    assert sorted(panels) == sorted([*expected, "latent · 2-D"])
    umap = next(p for p in shown.projections if (p.space, p.method) == ("raw", "umap"))
    filled, rings = panels["raw features · UMAP"].collections
    np.testing.assert_array_equal(filled.get_offsets(), umap.points[shown.training])
    np.testing.assert_array_equal(rings.get_offsets(), umap.points[~shown.training])
    colours = text_colours(shown.columns["category"])
    assert [to_hex(c) for c in rings.get_edgecolors()] == [
        to_hex(colours[c]) for c in shown.columns["category"][~shown.training]
    ]


def test_a_number_is_shaded_and_a_missing_one_grey(drawn):
    figure = drawn["embedding_projections", "by-angle_deg"]
    rings = figure.axes[0].collections[1]
    held_out = np.flatnonzero(~pictures().training)
    colours = [to_hex(c) for c in rings.get_edgecolors()]
    assert colours[held_out.tolist().index(3)] == MISSING
    assert len(set(colours)) == len(held_out)
    assert figure.axes[-1].get_ylabel() == "angle deg"


def test_things_have_colours_of_their_own():
    names = np.array([f"thing {i:02d}" for i in range(20)])
    assert len(set(text_colours(names).values())) == 20
    assert "" not in text_colours(np.array(["", "a"]))


def test_it_is_said_first_what_the_pairs_had_to_know():
    said = EXPERIMENTS["embedding_projections"].summary(results("embedding_projections"))
    assert said == f"What the pairs are made from: Which things are the same, and {SCRIPT}."


def test_stored_projections_are_what_they_were():
    tables = results("embedding_projections").results[0].tables
    found, shown = embedding_projections.projections_of(tables), pictures()
    assert found.recording.tolist() == shown.recording.tolist()
    assert found.training.tolist() == shown.training.tolist()
    assert list(found.columns) == list(shown.columns)
    np.testing.assert_array_equal(found.columns["angle_deg"], shown.columns["angle_deg"])
    for a, b in zip(found.projections, shown.projections, strict=True):
        assert (a.space, a.method) == (b.space, b.method)
        np.testing.assert_array_equal(a.points, b.points)
