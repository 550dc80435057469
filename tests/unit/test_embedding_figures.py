"""What the figures on embeddings show, read back from the drawn figure."""

import dataclasses
import math

import numpy as np
import pytest
from embedding_samples import DIMENSIONS, SCRIPT, THINGS, pictures, sample, transfer
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from matplotlib.colors import to_hex
from matplotlib.patches import Ellipse as EllipsePatch
from scipy.cluster.hierarchy import dendrogram
from test_report_figures import fits, texts

from ajgdata.pipeline.embed_documents import _transfer
from ajgdata.report.canvas import COLOURS, encode
from ajgdata.report.distances import apart_text, category_figure, object_figure, tree
from ajgdata.report.embedded import Distances, Pictured
from ajgdata.report.embedding_blocks import blocks, flat, probes_grid
from ajgdata.report.embedding_page import figures
from ajgdata.report.latents import (
    EXPECTED_WITHIN,
    Plane,
    category_colours,
    plane_caption,
    plane_figure,
)
from ajgdata.report.neighbours import gain_text, neighbours_figure
from ajgdata.report.probes import (
    LOWEST,
    probes_figure,
    retrieval_figure,
    transfer_caption,
    transfer_figure,
)
from ajgdata.report.projected import MISSING, projected_figure, shown_columns, text_colours


@pytest.fixture(scope="module")
def one():
    return sample()


@pytest.fixture(scope="module")
def drawn(one):
    return {name: shown.draw() for name, shown in figures([one]).items()}


def test_every_figure_says_simulated_fits_and_never_varies(one, drawn):
    assert set(drawn) == {
        f"d--poses--{name}"
        for name in (
            "plane", "neighbours", "categories", "objects-latent", "objects-raw", "by-object",
            "by-category", "by-angle_deg", "by-session_id", "probes", "retrieval",
        )
    }  # fmt: skip
    for name, figure in drawn.items():
        assert "simulated" in texts(figure), name
        assert fits(figure), name
    for name in ("d--poses--plane", "d--poses--by-object", "d--poses--objects-raw"):
        assert encode(figures([one])[name].draw(), "svg") == encode(drawn[name], "svg")


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
    assert (lonely.get_center(), lonely.width, lonely.height) == ((9, 9), 0, 0)
    np.testing.assert_array_equal(right.lines[0].get_xydata(), [[9, 9]])
    assert {"recorded", "ball", "pen", "spherical"} <= set(texts(figure))


@pytest.mark.parametrize(
    "points",
    [
        [[1, 2]],
        [[1, 2], [1, 2]],
        [[0, 0], [1, 1], [2, 2]],
        [[0, 0], [1e-300, 0]],
        [[0, 0], [5e-324, 0], [0, 5e-324]],
        [[1e300, -1e300], [1e300, 1e300], [-1e300, 0]],
        [[1e12, 1e12], [1e12 + 1, 1e12]],
    ],
)
def test_whatever_the_points_are_they_are_drawn(points):
    figure = plane_figure(plane(points), "t", "simulated")
    assert fits(figure)
    encode(figure, "png")
    lines = figure.axes[0].lines[0].get_xydata()
    assert lines.shape == (len(points), 2) and np.abs(lines).max() < 1e13
    low, high = figure.axes[0].get_xlim()
    assert np.all((lines[:, 0] >= low) & (lines[:, 0] <= high))


finite = st.floats(allow_nan=False, allow_infinity=False)


@settings(max_examples=4, derandomize=True, deadline=None)
@given(st.integers(1, 4).flatmap(lambda n: arrays(float, (n, 2), elements=finite)))
def test_any_points_are_drawn(points):
    assert plane_figure(plane(points), "t", "simulated").axes[0].lines[0].get_xydata().size


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
        Pictured(np.array(["a"]), np.array([True]), {"object": np.array(["a", "b"])}, ())


# distances


def test_the_tree_joins_what_is_near_whatever_the_order_of_the_objects():
    names = ["c", "a", "d", "b"]
    place = {"a": 0.0, "b": 1.0, "c": 10.0, "d": 12.0}
    at = np.array([place[name] for name in names])
    distance = np.abs(at[:, None] - at)
    found = tree(distance + np.eye(4), names)  # its diagonal does not matter
    assert [names[i] for i in found.order] == ["a", "b", "c", "d"]
    np.testing.assert_allclose(sorted(found.links[:, 2]), [1, 2, 10.5])
    back = names[::-1]
    again = tree(distance[::-1, ::-1], back)
    assert [back[i] for i in again.order] == ["a", "b", "c", "d"]
    np.testing.assert_array_equal(found.links, again.links)


@settings(max_examples=30, derandomize=True, deadline=None)
@given(arrays(float, (6, 6), elements=st.floats(0, 9)), st.permutations(range(6)))
def test_the_order_of_leaves_is_a_permutation_that_ignores_the_order_of_objects(m, order):
    m, names = m + m.T, np.array(list("abcdef"))
    first, other = tree(m, names), tree(m[np.ix_(order, order)], names[list(order)])
    assert sorted(first.order) == list(range(6))
    assert [names[i] for i in first.order] == [names[list(order)][i] for i in other.order]
    drawn = dendrogram(first.links, no_plot=True)["leaves"]
    assert [names[i] for i in first.order] == [np.sort(names)[i] for i in drawn]


def test_unknown_distances_count_as_the_largest_and_one_object_is_no_tree():
    nan = math.nan
    found = tree([[nan, 1, nan], [1, nan, 5], [nan, 5, nan]], ["a", "b", "c"])
    np.testing.assert_allclose(found.links[:, 2], [1, 5])
    assert tree([[nan, nan], [nan, nan]], ["a", "b"]).order == [0, 1]
    assert tree([[0.0]], ["a"]) is None


def test_the_matrix_stands_in_the_order_of_the_tree(one):
    latent = one.distances[0]
    order = tree(latent.object_mean, latent.objects).order
    branches, axes, *_ = object_figure(latent, "t", "simulated").axes
    shown = np.asarray(axes.get_images()[0].get_array())
    np.testing.assert_array_equal(shown, latent.object_mean[np.ix_(order, order)])
    labels = [t.get_text() for t in axes.get_yticklabels()]
    assert labels == [latent.objects[i] for i in order]
    colours = category_colours(list(THINGS.values()))
    assert [t.get_color() for t in axes.get_yticklabels()] == [
        colours[THINGS[label]] for label in labels
    ]
    # each leaf of the tree ends at height 0 in the middle of its row
    ends = sorted(y for line in branches.lines for x, y in line.get_xydata() if x == 0)
    assert ends == [0, 1, 2, 3] and branches.get_ylim() == axes.get_ylim()
    alone = dataclasses.replace(
        latent, objects=("a",), object_category=("b",), object_mean=np.zeros((1, 1))
    )
    assert fits(object_figure(alone, "t", "simulated"))


def test_categories_are_compared_with_the_mean_of_the_others(one):
    latent = one.distances[0]
    assert latent.apart() == {"cylindrical": True, "other": False, "spherical": True}
    assert apart_text(latent) == (
        "cylindrical 1 within < 3 between, other 5 within not < 3 between, "
        "spherical 1 within < 3 between"
    )
    figure = category_figure(one.distances, "t", "simulated")
    assert {"1.00\n± 0.10", "5.00\n± 0.10", "—", "latent: different things only"} <= set(
        texts(figure)
    )
    with pytest.raises(ValueError, match="2 categories, but shapes"):
        dataclasses.replace(latent, categories=("a", "b"))
    with pytest.raises(ValueError, match="1 objects, but shape"):
        Distances(
            "raw", (), *[np.zeros((0, 0))] * 4, objects=("a",), object_category=("b",),
            object_mean=np.zeros((2, 2)), per_run=np.zeros((1, 0, 0)),
        )  # fmt: skip


# k-NN


def test_accuracy_stands_against_dimension_and_against_time(one):
    left, right = neighbours_figure(one, "t", "simulated").axes
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


def test_the_gain_is_told_in_points_and_relative(one):
    assert gain_text(one) == (
        "k-NN on the latent reaches 55 ± 14 % at its best dimension, 4, on raw features "
        "50 ± 14 %: 5 percentage points, or 10 %, higher"
    )
    worse = tuple(
        row._replace(score=row.score._replace(mean=0.4)) if row.space == "latent" else row
        for row in one.neighbours
    )
    said = gain_text(dataclasses.replace(one, neighbours=worse))
    assert said.endswith("10 percentage points, or 20 %, lower") and "dimension, 2," in said
    assert gain_text(dataclasses.replace(one, neighbours=())) == ""


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


def test_each_space_and_method_has_its_panel_with_its_points(one):
    shown = one.pictured
    figure = projected_figure(shown, "category", "t", "simulated")
    panels = {axes.get_title(): axes for axes in figure.axes}
    assert list(panels) == [
        f"{space} · {method}"
        for space in ("latent", "raw features")
        for method in ("PCA", "UMAP", "t-SNE")
    ]
    umap = next(p for p in shown.pictures if (p.space, p.method) == ("raw", "umap"))
    filled, rings = panels["raw features · UMAP"].collections
    np.testing.assert_array_equal(filled.get_offsets(), umap.points[shown.training])
    np.testing.assert_array_equal(rings.get_offsets(), umap.points[~shown.training])
    colours = text_colours(shown.columns["category"])
    assert [to_hex(c) for c in rings.get_edgecolors()] == [
        to_hex(colours[c]) for c in shown.columns["category"][~shown.training]
    ]


def test_a_number_is_shaded_and_a_missing_one_grey(one):
    figure = projected_figure(one.pictured, "angle_deg", "t", "simulated")
    rings = figure.axes[0].collections[1]
    held_out = np.flatnonzero(~one.pictured.training)
    colours = [to_hex(c) for c in rings.get_edgecolors()]
    assert colours[held_out.tolist().index(3)] == MISSING
    assert len(set(colours)) == len(held_out)
    assert figure.axes[-1].get_ylabel() == "angle deg"


def test_things_have_colours_of_their_own():
    names = np.array([f"thing {i:02d}" for i in range(20)])
    assert len(set(text_colours(names).values())) == 20
    assert "" not in text_colours(np.array(["", "a"]))


# probes, retrieval, transfer


def test_probes_stand_at_their_scores_and_far_below_zero_at_the_edge(one):
    figure = probes_figure(one.probes, "t", "simulated")
    left, right = figure.axes
    assert [t.get_text() for t in left.get_yticklabels()] == ["object (accuracy)", "angle deg (R²)"]
    found = {c.get_label(): c.lines[0].get_xdata().astype(float) for c in left.containers}
    np.testing.assert_allclose(found["latent, linear"], [0.7, LOWEST])
    np.testing.assert_allclose(found["raw features, k-NN"], [0.5, LOWEST])
    assert (left.get_title(), right.get_title()) == ("new grasps of known things", "unseen things")
    assert all(len(c.lines[0].get_xdata()) == 1 for c in right.containers)
    grid = probes_grid(one.probes)
    assert grid.rows[0] == (
        "object", "new grasps of known things", "accuracy", "0.25",
        "0.70 ± 0.14", "0.70 ± 0.14", "0.50 ± 0.14", "0.50 ± 0.14",
    )  # fmt: skip


def test_precision_falls_with_k_in_its_gallery(one):
    figure = retrieval_figure(one.retrieval, "t", "simulated")
    assert [axes.get_title() for axes in figure.axes] == [
        "gallery: unseen things", "gallery: all things",
    ]  # fmt: skip
    bars = {c.get_label(): c.lines[0].get_xydata() for c in figure.axes[0].containers}
    np.testing.assert_allclose(bars["latent"], [[1, 80], [5, 16]])


def test_transfer_has_a_panel_for_each_gripper():
    found = _transfer(transfer())
    figure = transfer_figure(found, "t", "simulated")
    assert fits(figure)
    assert [axes.get_title() for axes in figure.axes] == ["tall", SCRIPT]
    bars = {c.get_label(): c.lines[0].get_ydata().astype(float) for c in figure.axes[0].containers}
    np.testing.assert_allclose(bars["raw features"], [10, 50])
    np.testing.assert_allclose(bars["latent across grippers"], [40, 80])
    assert "latent across grippers on tall, 4 grasps: 80.0 ± 7.1 %" in (transfer_caption(found).alt)
    three = dataclasses.replace(found, held_out_grippers=("tall", SCRIPT, "wide"))
    moved = tuple(row._replace(gripper="wide") for row in found.rows if row.gripper == "tall")
    figure = transfer_figure(dataclasses.replace(three, rows=found.rows + moved), "t", "simulated")
    assert fits(figure)
    assert [axes.get_title() for axes in figure.axes if axes.get_visible()] == [
        "tall", SCRIPT, "wide",
    ]  # fmt: skip


def test_what_was_not_made_is_not_shown(one):
    nothing = dataclasses.replace(
        one, neighbours=(), distances=(), probes=(), retrieval=(), pictured=None
    )
    assert blocks(nothing) == [] and flat(nothing) is None
    lone = dataclasses.replace(nothing, transfer=_transfer(transfer()))
    assert [block.id for block in blocks(lone)] == ["probes", "transfer"]
