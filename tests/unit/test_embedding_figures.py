"""What the figures on embeddings show, read back from the drawn figure."""

import dataclasses
import math

import numpy as np
import pytest
from drawn_figures import fits, smallest_pt, texts
from embedding_samples import (
    DIMENSIONS,
    SCRIPT,
    TABLES,
    THINGS,
    distances,
    figures,
    knn,
    pictures,
    projections,
    results,
)
from matplotlib.colors import to_hex
from matplotlib.patches import Ellipse as EllipsePatch

from ajgdata.experiments import (
    EXPERIMENTS,
    embedding_projections,
)
from ajgdata.experiments.embedding_distances import (
    apart_text,
    distances_of,
    leaves,
    links,
    object_figure,
)
from ajgdata.experiments.embedding_knn import gain_text
from ajgdata.report.canvas import COLOURS, draw, encode, styled
from ajgdata.report.latent_plane_figure import EXPECTED_WITHIN, Plane, plane_caption
from ajgdata.report.latent_plane_figure import plane_figure as unstyled_plane
from ajgdata.report.projections import (
    MISSING,
    Projection,
    Projections,
    category_colours,
    shown_columns,
    text_colours,
)

plane_figure = styled(unstyled_plane)


@pytest.fixture(scope="module")
def drawn():
    """Every figure, by experiment and name."""
    listed = {kind: figures(results(kind)) for kind in TABLES}
    return {(k, name): draw(one) for k, some in listed.items() for name, one in some.items()}


def test_every_figure_says_simulated_fits_and_never_varies(drawn):
    assert set(drawn) == {
        ("embedding_knn", ""),
        *(("embedding_distances", n) for n in ("categories", "objects-latent", "objects-raw")),
        ("embedding_retrieval", ""),
        *(
            ("embedding_projections", name)
            for name in ("plane", "by-object", "by-category", "by-angle_deg", "by-session_id")
        ),
    }
    for key, figure in drawn.items():
        assert "simulated" in texts(figure), key
        assert any(text.startswith("Things · poses: ") for text in texts(figure)), key
        assert fits(figure), key
        assert smallest_pt(figure) >= 7.8, key
    for kind, name in (("embedding_projections", "plane"), ("embedding_distances", "objects-raw")):
        again = draw(figures(results(kind))[name])
        assert encode(again, "svg") == encode(drawn[kind, name], "svg")


def test_captions_say_whose_and_whether_it_is_simulated():
    for kind in TABLES:
        for one in figures(results(kind, source="recorded")).values():
            assert one.caption.text.startswith("Things · poses, recorded. ")
            assert one.caption.alt.endswith(" Things · poses, recorded.")


def title(figure):
    """The head of a figure, its lines joined."""
    bold = [text for text in figure.texts if text.get_fontweight() == "bold"]
    return " ".join(text.get_text() for text in bold if text.get_color() != "white")


def test_titles_say_what_was_found(drawn):
    said = {
        ("embedding_knn", ""): "k-NN reaches 55 ± 14 % on a latent of 4 dimensions, 50 ± 14 % on "
        "raw features (chance 25 %)",
        ("embedding_distances", "categories"): "Categories whose members lie nearer to one another "
        "than to others: 2 of 3 in latent, 2 of 3 in raw features",
    }
    for key, expected in said.items():
        assert title(drawn[key]) == expected
        assert figures(results(key[0]))[key[1]].caption.alt.startswith(expected)


def test_the_nearest_training_recordings_are_told_of_what_is_coloured():
    points = np.array([[0.0, 0], [1, 0], [10, 0], [0.1, 0], [9, 0], [0.9, 0], [0.2, 0]])
    training = np.arange(7) < 3
    shown = Projections(
        np.array([f"r{i}" for i in range(7)]), training,
        {"thing": np.array(["a", "b", "b", "a", "b", "a", ""]),
         "height_mm": np.array([1.0, 2, 3, 1.5, 7, np.nan, 1])},
        (Projection("latent", "pca", points), Projection("raw", "tsne", points)),
    )  # fmt: skip
    told = embedding_projections.finding
    # of three that are known, two lie beside a recording of the same thing; t-SNE is not asked
    assert told(shown, "thing").endswith("is of the same thing for 66.7 % (latent, PCA)")
    # |1.5 − 1|, |7 − 3| and |1 − 1|
    assert told(shown, "height_mm").endswith("differs in height mm by 0.5 (latent, PCA)")
    alone = dataclasses.replace(shown, training=np.ones(7, bool))
    assert told(alone, "thing") == "Recordings in two dimensions, by thing"


# the plane


def plane(points, things=None, training=None) -> Plane:
    n = len(points)
    things = np.array(["ball"] * n if things is None else things)
    return Plane(
        np.asarray(points, float),
        things,
        np.array(["spherical"] * n),
        np.ones(n, bool) if training is None else np.asarray(training),
    )


def test_an_ellipse_is_drawn_where_the_points_of_an_object_are():
    points = [[3, 0], [-3, 0], [0, 1], [0, -1], [9, 9]]
    figure = plane_figure(
        plane(points, ["ball"] * 4 + ["pen"], np.ones(5) == [1, 1, 1, 1, 0]), "t", "recorded"
    )
    left, right = figure.axes
    assert [axes.get_title() for axes in (left, right)] == [
        "training points (4)", "validation points (1)",
    ]  # fmt: skip
    (patch,) = (p for p in left.patches if isinstance(p, EllipsePatch))
    assert patch.get_center() == pytest.approx((0, 0), abs=1e-15)
    # variance 18/3 and 2/3, two deviations on each side
    assert (patch.width, patch.height) == pytest.approx((4 * math.sqrt(6), 4 * math.sqrt(2 / 3)))
    assert patch.angle == pytest.approx(0, abs=1e-12)
    assert to_hex(patch.get_edgecolor()) == to_hex(COLOURS[0])
    (lonely,) = (p for p in right.patches if isinstance(p, EllipsePatch))
    assert (*lonely.get_center(), lonely.width, lonely.height) == (9, 9, 0, 0)
    np.testing.assert_array_equal(right.lines[0].get_xydata(), [[9, 9]])
    assert {"recorded", "ball", "pen", "spherical"} <= set(texts(figure))


@pytest.mark.parametrize(
    "points",
    [
        [[1, 2]],
        [[1, 2], [1, 2]],
        [[0, 0], [1, 1], [2, 2]],
        [[0, 0], [1e-100, 0]],
        [[1e100, -1e100], [1e100, 1e100], [-1e100, 0]],
        [[1e12, 1e12], [1e12 + 1, 1e12]],
    ],
)
def test_whatever_the_points_are_they_are_drawn(points):
    figure = plane_figure(plane(points), "t", "simulated")
    assert fits(figure)
    encode(figure, "png")
    lines = figure.axes[0].lines[0].get_xydata()
    assert lines.shape == (len(points), 2)
    low, high = figure.axes[0].get_xlim()
    assert np.all((lines[:, 0] >= low) & (lines[:, 0] <= high))


def test_the_share_of_validation_points_within_their_training_ellipse():
    # ball: a circle of radius 2 sqrt(2/3) = 1.63 around 0; pen: the line from -2 to 2 times sqrt 2
    ball, pen = [[1, 0], [-1, 0], [0, 1], [0, -1]], [[8, 0], [12, 0]]
    held_out = {"ball": [[1.6, 0], [1.7, 0]], "pen": [[10, 0], [10, 0.1]], "new": [[0, 0]]}
    names = ["ball"] * 4 + ["pen"] * 2
    names += [name for name, points in held_out.items() for _ in points]
    points = np.vstack([ball, pen, *held_out.values()])
    shown = plane(points, names, np.arange(len(names)) < 6)
    assert shown.within() == 2 / 5  # a thing that was never trained on has no ellipse
    assert pytest.approx(1 - math.exp(-2)) == EXPECTED_WITHIN
    # the four of ball and pen are nearest to their own means, which lie 10 apart
    assert shown.nearest() == 4 / 5
    told = plane_caption(shown).text
    assert (
        "80 % lie nearest to the mean of their own object's training points (chance 33.3 %)" in told
    )
    assert "and 40 % within 2σ of them" in told
    alone = plane(points, names)
    assert math.isnan(alone.within()) and math.isnan(alone.nearest())
    assert "Of the validation points" not in plane_caption(alone).text


def test_categories_keep_their_colours_and_others_get_further_ones():
    found = category_colours(np.array(["zinc", "other", "spherical", "", "other"]))
    assert list(found) == ["spherical", "other", "", "zinc"]
    assert found["spherical"] == COLOURS[0] and found["other"] == COLOURS[2]
    assert len(set(found.values())) == 4


def test_lengths_that_differ_are_refused():
    with pytest.raises(ValueError, match="do not match"):
        Plane(np.zeros((2, 2)), np.array(["a"]), np.array(["a"]), np.array([True]))
    with pytest.raises(ValueError, match=r"lengths \[1, 2\]"):
        Projections(np.array(["a"]), np.array([True]), {"object": np.array(["a", "b"])}, ())


# distances


def test_unknown_distances_count_as_the_largest():
    latent = distances_of(results("embedding_distances"))[0]
    nan = math.nan
    mean = np.array([[nan, 1, nan], [1, nan, 5], [nan, 5, nan]])
    three = dataclasses.replace(latent, objects=("a", "b", "c"), object_mean=mean)
    np.testing.assert_allclose(links(three)[:, 2], [1, 5])
    unknown = dataclasses.replace(latent, objects=("a", "b"), object_mean=np.full((2, 2), nan))
    assert sorted(leaves(unknown)) == [0, 1]


def test_the_matrix_stands_in_the_order_of_the_tree(drawn):
    one = results("embedding_distances")
    latent = distances_of(one)[0]
    order = leaves(latent)
    branches, axes, *_ = drawn["embedding_distances", "objects-latent"].axes
    shown = np.asarray(axes.get_images()[0].get_array())
    np.testing.assert_array_equal(shown, latent.object_mean[np.ix_(order, order)])
    labels = [t.get_text() for t in axes.get_yticklabels()]
    assert labels == [latent.objects[i] for i in order]
    colours = category_colours(list(THINGS.values()))
    assert [t.get_color() for t in axes.get_yticklabels()] == [
        colours[THINGS[label]] for label in labels
    ]
    # each leaf of the tree ends at height 0; scipy places leaf k at 10 k + 5
    ends = [
        y for one in branches.collections for path in one.get_paths()
        for x, y in path.vertices if x == 0
    ]  # fmt: skip
    assert sorted(ends) == [5, 15, 25, 35]
    low, high = branches.get_ylim()
    assert low > high  # the first leaf is at the top, as the first row of the matrix
    alone = dataclasses.replace(
        latent, objects=("a",), object_category=("b",), object_mean=np.zeros((1, 1))
    )
    assert fits(styled(object_figure)(one, alone))


def test_categories_are_compared_with_the_mean_of_the_others(drawn):
    latent = distances_of(results("embedding_distances"))[0]
    assert latent.apart() == {"cylindrical": True, "other": False, "spherical": True}
    assert apart_text(latent) == (
        "cylindrical 1 within < 3 between, other 5 within not < 3 between, "
        "spherical 1 within < 3 between"
    )
    figure = drawn["embedding_distances", "categories"]
    assert {"1.00\n± 0.10", "5.00\n± 0.10", "—", "latent: different things only"} <= set(
        texts(figure)
    )


def test_gaps_are_to_the_mean_of_the_others():
    within = {"cylindrical": 1, "other": 2, "spherical": 1}
    one = results("embedding_distances", distances(within, narrower=0.1))
    gaps = distances_of(one)[0].gaps()
    assert gaps["spherical"].mean == pytest.approx(2)
    assert gaps["cylindrical"].mean == pytest.approx(2.05)
    assert gaps["cylindrical"].sd == pytest.approx(0.1 / 2**0.5)


# k-NN


def test_accuracy_stands_against_dimension_and_against_time(drawn):
    left, right = drawn["embedding_knn", ""].axes
    bars = {c.get_label(): c.lines[0].get_xydata() for c in left.containers}
    np.testing.assert_allclose(bars["latent"], [[2, 50], [4, 55]])
    np.testing.assert_allclose(bars["PCA"], [[2, 30], [4, 35]])
    raw = next(line for line in left.lines if line.get_label() == "raw features")
    assert raw.get_ydata()[0] == 50
    # raw beats all PCA and UMAP; of the latents one is better than it, in 4 s + 0.03 s
    front = next(line for line in right.lines if line.get_label() == "Pareto front")
    np.testing.assert_allclose(front.get_xydata(), [[0.03, 50], [4.03, 55]])
    assert [t.get_text() for t in left.get_xticklabels()] == [str(d) for d in DIMENSIONS]
    assert right.get_ylim() == left.get_ylim() and left.get_ylim()[0] == 0


def test_the_gain_is_told_in_points_and_relative():
    assert gain_text(results("embedding_knn")) == (
        "k-NN on the latent reaches 55 ± 14 % at 4 dimensions, on raw features "
        "50 ± 14 %: 5 percentage points, or 10 %, higher"
    )
    worse = results("embedding_knn", knn({"latent": [0.1, 0.1], "raw": [0.6, 0.65]}))
    said = gain_text(worse)
    assert said.endswith("52.5 percentage points, or 84 %, lower") and "at 4 dimensions" in said


def test_the_table_of_knn_says_what_training_took_and_what_pairs_are_made_from():
    accuracy, asked = EXPERIMENTS["embedding_knn"].tables(results("embedding_knn"))
    assert "4 networks were trained in 20 s of one core" in accuracy.caption
    assert accuracy.rows[1][:3] == ("4", "55 ± 14 %; 4 s", "50 ± 14 %; 0.03 s")
    assert asked.rows[0] == (
        "what the pairs are made from", f"Which things are the same, and {SCRIPT}."
    )  # fmt: skip
    assert dict(asked.rows[1:])["dimensions"] == "2; 4"


# projections


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
    panels = {axes.get_title(): axes for axes in figure.axes}
    assert list(panels) == [
        f"{space} · {method}"
        for space in ("latent", "raw features")
        for method in ("PCA", "UMAP", "t-SNE")
    ]
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


# silhouettes, retrieval


def test_a_silhouette_of_some_points_says_of_how_many():
    found = results("embedding_projections")
    about = {"silhouette_on": 5000, "silhouette_of": 12_000}
    some = dataclasses.replace(found, results=(dataclasses.replace(found.results[0], about=about),))
    (silhouettes,) = EXPERIMENTS["embedding_projections"].tables(some)
    assert silhouettes.rows == (("object", "0.30 ± 0.14", "-0.10 ± 0.14"),)
    assert silhouettes.caption.endswith("of validation points (5,000 of 12,000 in a run).")


def test_precision_falls_with_k_in_its_gallery(drawn):
    figure = drawn["embedding_retrieval", ""]
    assert [axes.get_title() for axes in figure.axes] == [
        "gallery: unseen things", "gallery: all things",
    ]  # fmt: skip
    bars = {c.get_label(): c.lines[0].get_xydata() for c in figure.axes[0].containers}
    np.testing.assert_allclose(bars["latent"], [[1, 80], [5, 16]])


def test_what_was_not_made_is_not_shown():
    recordings, points, _ = projections()
    flat = [recordings, points.where(space="raw")]
    assert "plane" not in figures(results("embedding_projections", flat))
    assert embedding_projections.clusters_of(results("embedding_projections", flat)) == ""


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
