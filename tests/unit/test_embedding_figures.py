"""What is shown of embeddings, from stored results to the drawn figure."""

import numpy as np
import pytest
from embedding_samples import distances, figures, pictures, results

from ajgdata.experiments import embedding_projections
from ajgdata.experiments.embedding_distances import categories_of
from ajgdata.report.canvas import draw
from ajgdata.report.projections import (
    text_colours,
)


def test_gaps_are_to_the_mean_of_the_others():
    within = {"cylindrical": 1, "other": 2, "spherical": 1}
    one = results("embedding_distances", distances(within, narrower=0.1))
    found = categories_of(one, "latent")
    assert found["spherical"].gap.mean == pytest.approx(2)
    assert found["cylindrical"].gap.mean == pytest.approx(2.05)
    assert found["cylindrical"].gap.sd == pytest.approx(0.1 / 2**0.5)


def test_each_space_and_method_has_its_panel_with_its_points():
    shown = pictures()
    figure = draw(figures(results("embedding_projections"))["by-category"])
    panels = {axes.get_title(): axes for axes in figure.axes if axes.get_title()}
    assert len(panels) == 2 * 3 + 1  # spaces, methods; and the two-dimensional latent
    umap = next(p for p in shown.projections if (p.space, p.method) == ("raw", "umap"))
    category = shown.columns["category"]
    drawn = panels["raw features · UMAP"].collections
    for index, name in enumerate(text_colours(category)):
        filled, rings = drawn[2 * index : 2 * index + 2]
        own = category == name
        np.testing.assert_array_equal(filled.get_offsets(), umap.points[own & shown.training])
        np.testing.assert_array_equal(rings.get_offsets(), umap.points[own & ~shown.training])


def test_stored_projections_are_what_they_were():
    tables = results("embedding_projections").results[0].tables
    found, shown = embedding_projections.projections_of(tables), pictures()
    assert found.recording.tolist() == shown.recording.tolist()
    assert found.training.tolist() == shown.training.tolist()
    np.testing.assert_array_equal(found.columns["angle_deg"], shown.columns["angle_deg"])
    for a, b in zip(found.projections, shown.projections, strict=True):
        assert (a.space, a.method) == (b.space, b.method)
        np.testing.assert_array_equal(a.points, b.points)
