"""Draws of grippers: stratified, resumable, and analyses that find what was put in."""

import hashlib

import numpy as np
import pytest
from drawn_figures import fits

from ajgdata.draws import DEFAULT, draw_names, measuring
from ajgdata.draws.posterior import EVEN_SD, misses, shift_of, together, tolerance_of
from ajgdata.draws.recordings import merged, recipe_with
from ajgdata.draws.rows import BY_NAME as ROW_BY_NAME
from ajgdata.draws.rows import REDUCED, ROWS, reduced
from ajgdata.draws.sampling import (
    NOT_DRAWN,
    drawn_parameters,
    hypercube,
    place_of,
    stratified,
    value_at,
    values_of,
)
from ajgdata.draws.sensitivity import emulate, marginal, sobol
from ajgdata.draws.sweep import Sweep, joined
from ajgdata.draws.tables import sweep_tables
from ajgdata.gripper import Scene, SignalChain
from ajgdata.gripper.parameters import PARAMETERS
from ajgdata.gripper.variation import Variation
from ajgdata.paths import Paths
from ajgdata.pipeline.draws import draws_tables, join_draws, kept_files, run_draw
from ajgdata.report.canvas import draw
from ajgdata.report.paper import parse_paper
from ajgdata.report.study_figures import FIGURES
from ajgdata.store.files import csv_bytes, read_csv, read_json, write_bytes
from ajgdata.store.report_files import read_paper
from ajgdata.store.sessions import read_dataset
from ajgdata.store.tables import read_tables
from ajgdata.types import DataError, NotPossibleError

#: Figures of the paper that the made-up sweep is held beside.
TARGETS = {row.paper: 5.0 for row in ROWS}


@pytest.mark.parametrize("count", [1, 3, 20])
def test_each_margin_is_stratified_and_the_same_each_time(count):
    parameters = drawn_parameters()
    places = hypercube(count, parameters)
    assert places.shape == (count, len(parameters))
    for column in places.T:
        assert sorted((column * count).astype(int)) == list(range(count))
    np.testing.assert_array_equal(places, hypercube(count, parameters))
    assert count == 1 or not np.array_equal(places, hypercube(count, parameters, seed=1))
    # A parameter more changes no other.
    np.testing.assert_array_equal(places[:, 1:], hypercube(count, parameters[1:]))


def test_columns_of_two_settings_are_independent():
    one, other = stratified(400, "a"), stratified(400, "b")
    assert abs(np.corrcoef(one, other)[0, 1]) < 4 / np.sqrt(400)  # four standard errors


def test_what_is_drawn_has_a_range_and_is_within_it():
    parameters = {one.setting: one for one in drawn_parameters()}
    assert all(one.low < one.high for one in parameters.values())
    left = [p.setting for p in PARAMETERS if p.low < p.high and p.setting not in parameters]
    assert left
    assert all(setting.startswith(NOT_DRAWN) for setting in left)
    for number in (0, 2):
        for setting, value in values_of(number, 3).items():
            one = parameters[setting]
            assert one.low * (1 - 1e-5) - 1e-9 <= value <= one.high * (1 + 1e-5) + 1e-9
            assert value == pytest.approx(value_at(one, place_of(one, value)), rel=1e-5)


def test_a_log_range_is_even_in_its_logarithm():
    one = next(p for p in drawn_parameters() if p.setting == "gripper.wall_admittance")
    assert value_at(one, 0.5) == pytest.approx(np.sqrt(one.low * one.high), rel=1e-5)


@pytest.mark.parametrize("dataset", REDUCED)
def test_every_drawn_gripper_is_a_valid_recipe(dataset):
    """Corners of the ranges, too: a draw may lie anywhere in them."""
    spec = read_dataset(Paths(), dataset)
    assert set(REDUCED[dataset].left_out) <= {one.name for one in spec.recipe.objects}
    for end in ("low", "high"):
        values = {one.setting: getattr(one, end) for one in drawn_parameters()}
        recipe = recipe_with(reduced(spec.recipe, REDUCED[dataset]), values, "draw_007", 5)
        variation = Variation.model_validate(recipe.variation)
        assert variation.gripper.name == "draw_007"
        assert recipe.seed == 5
        assert SignalChain.model_validate(recipe.signal) != SignalChain()
        for variant in recipe.variants.values() or [{}]:
            scene = Scene.model_validate({**recipe.scene, **variant})
            assert scene.gripper.height_mm == values["gripper.height_mm"]
            assert scene.medium.heave_deg == values["medium.heave_deg"]
            packed = scene.medium.kind != "coffee"
            assert (scene.medium.porosity == values["medium.porosity"]) == packed
            assert (scene.support.kind == "concave") == ("support" in spec.recipe.scene)
    kept = reduced(spec.recipe, REDUCED[dataset], quick=True)
    assert kept.sessions == 1
    assert len(kept.objects) <= len(spec.recipe.objects)


def test_what_a_recipe_says_itself_stays():
    spec = read_dataset(Paths(), "size")
    recipe = recipe_with(spec.recipe, {"signal.gain_db": 3.0})
    assert recipe.signal == {"gain_db": 3.0, "external_noise_dba": 45}
    assert merged({"a": {"b": [1]}}, {"a": {"b": [2]}, "c": 3}) == {"a": {"b": [2]}, "c": 3}


def ishigami(places: np.ndarray) -> np.ndarray:
    """sin x + 7 sin² y + 0.1 z⁴ sin x on [-π, π]³: indices known in closed form."""
    x, y, z = (np.pi * (2 * places - 1)).T
    return np.sin(x) + 7 * np.sin(y) ** 2 + 0.1 * z**4 * np.sin(x)


def test_sobol_indices_of_ishigami():
    a, b = 7.0, 0.1
    alone = [0.5 * (1 + b * np.pi**4 / 5) ** 2, a**2 / 8, 0.0]
    joint = b**2 * np.pi**8 * (1 / 18 - 1 / 50)
    total = sum(alone) + joint
    found = sobol(ishigami, 3, seed=1, points=2048)
    truth_total = np.array([alone[0] + joint, alone[1], joint]) / total
    # Within the 95 % interval of the sampling, twice; which is itself no more than a tenth.
    assert np.all(found.reach < 0.1)
    np.testing.assert_array_less(np.abs(found.total - truth_total), 2 * found.reach + 1e-3)
    np.testing.assert_allclose(found.first, np.array(alone) / total, atol=0.05)


def test_an_emulator_says_how_wrong_it_is():
    rng = np.random.default_rng(0)
    places = rng.uniform(size=(100, 3))
    known = emulate(places, ishigami(places))
    assert known.r2 > 0.5
    fresh = rng.uniform(size=(100, 3))
    error = np.mean((known.predict(fresh) - ishigami(fresh)) ** 2) / ishigami(fresh).var()
    assert 1 - error > known.r2 - 0.15  # as good on new points as it says, or better
    assert emulate(places, rng.normal(size=100)).r2 < 0.1
    with pytest.raises(ValueError, match="too few"):
        emulate(places[:3], np.arange(3.0))


def test_abc_of_a_toy_gives_the_known_posterior():
    """x even in [0, 1], y = 2x: within 0.2 of 1.2 it is even in [0.5, 0.7]."""
    rng = np.random.default_rng(3)
    places = rng.uniform(size=(20_000, 2))
    kept = misses(2 * places[:, 0], 1.2, 0.2) <= 1
    assert kept.mean() == pytest.approx(0.2, abs=4 * np.sqrt(0.2 * 0.8 / 20_000))
    shift = shift_of(places, kept)
    error = EVEN_SD / np.sqrt(kept.sum())
    assert shift.mean[0] == pytest.approx((0.6 - 0.5) / EVEN_SD, abs=4 * 0.2 * error / EVEN_SD)
    assert shift.spread[0] == pytest.approx(0.2, abs=0.01)
    assert abs(shift.mean[1]) < 4 * error / EVEN_SD
    assert shift.p[0] < 1e-6
    assert shift.p[1] > 0.01


def test_misses_know_their_side_and_what_is_missing():
    values = np.array([70.0, 90.0, np.nan])
    np.testing.assert_array_equal(misses(values, 80, 5, "at least"), [2, 0, np.inf])
    np.testing.assert_array_equal(misses(values, 80, 5, "at most"), [0, 2, np.inf])
    np.testing.assert_array_equal(misses(values, 80, 5), [2, 2, np.inf])
    both = together([np.array([3.0, 0.5]), np.array([0.2, 9.0]), np.array([1.0, 1.0])], "aab")
    np.testing.assert_array_equal(both, [1.0, 1.0])
    assert tolerance_of(np.array([1.0, np.nan, 3.0]), np.zeros(3)) == 4.0
    assert tolerance_of(np.zeros(2), np.array([6.0, 6.0])) == 6.0
    assert np.isnan(tolerance_of(np.full(2, np.nan), np.zeros(2)))
    # Not as far as chance, which would count what reads nothing as like the paper.
    assert tolerance_of(np.full(2, 9.0), np.zeros(2), to_chance=5.0) == 2.5
    assert tolerance_of(np.full(2, 1.0), np.zeros(2), to_chance=5.0) == 2.0


def test_what_no_rank_correlation_says_is_not_named():
    places = hypercube(100, drawn_parameters())
    chance = np.random.default_rng(5).standard_normal(100)
    p = marginal(places, places[:, 3] + 0.1 * chance)
    assert p[3] < 1e-6
    assert (np.delete(p, 3) > 0.05).all()
    assert (marginal(places, chance) > 0.05).all()


#: Rows of the made-up sweep: near a figure, two readings of one, at least and at most one.
SOME = ("size_known", "size_copies", "coffee", "metal")


def made_up(count: int = 150, wrong: float = 0.0) -> Sweep:
    """Every row is 5 in the middle of the gripper's height, and moves with it alone."""
    parameters = drawn_parameters()
    places = hypercube(count, parameters)
    columns = {
        one.setting: np.array([value_at(one, place) for place in column])
        for one, column in zip(parameters, places.T, strict=True)
    }
    height = places[:, [one.setting for one in parameters].index("gripper.height_mm")]
    for row in (row for row in ROWS if row.name in SOME):
        key = f"{row.name}.{'energy' if row.dataset == 'media' else row.model}"
        target = 5.0 if row.target is None else row.target
        columns[key] = target + wrong + 10 * (height - 0.5)
        columns |= {f"{key}.sd": np.full(count, 0.5), f"{key}.step": np.zeros(count)}
    return Sweep(tuple(draw_names(count)), columns, {"size_known.cnn": 4.5})


def test_a_sweep_beside_the_paper_finds_what_moves_it_and_who_is_near():
    tables = {one.name: one for one in sweep_tables(made_up(), TARGETS, points=256)}
    rows = tables["draws_rows"]
    assert rows.column("default") == [4.5, None, None, None]
    assert len(rows.rows) == len(SOME)
    assert rows.column("q50") == pytest.approx(rows.column("paper"), abs=0.2)
    assert set(rows.column("moved_by")) == {"gripper.height_mm"}
    said = "In 4 of 4 rows the paper's figure is within what the drawn grippers give"
    assert FIGURES["draws"][0].caption(rows).alt.startswith(said)
    # Tolerance 1 of 10: heights within 0.1 of the middle, a fifth of the draws. At least and at
    # most add one side each, and cannot take any away.
    agreement = tables["draws_agreement"]
    assert agreement.column("accepted")[0] == 30
    assert "30 of 150 drawn grippers are within tolerance" in agreement.note
    posterior = tables["draws_posterior"].rows[0]
    assert posterior["setting"] == "gripper.height_mm"
    assert posterior["spread"] == pytest.approx(0.2, abs=0.05)
    for figure in FIGURES["draws"]:
        assert fits(draw(figure.of(tables[figure.table])))


def test_where_no_draw_is_like_the_paper_it_is_said():
    tables = {one.name: one for one in sweep_tables(made_up(10, wrong=20.0), TARGETS, points=256)}
    assert tables["draws_agreement"].column("accepted") == [0, 0, 0]
    assert "None of 10 drawn grippers is within tolerance" in tables["draws_agreement"].note
    assert "nearest draws, as too few are accepted" in tables["draws_posterior"].note
    with pytest.raises(NotPossibleError, match="too few"):
        sweep_tables(made_up(3), TARGETS)


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """Three draws and the default gripper, a few coarse plates each, as jobs of the workflow."""
    out = Paths(tmp_path_factory.mktemp("draws"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(measuring, "REDUCED", {"plate": REDUCED["plate"]})
        for name in MADE:
            run_draw(Paths(), name, 3, out.draw(3, name), out.draw_cost(3, name), quick=True)
        yield out


MADE = [*draw_names(3), DEFAULT]


def join(out: Paths) -> bytes:
    draws = [out.draw(3, name) for name in MADE]
    costs = [out.draw_cost(3, name) for name in MADE]
    join_draws(draws, costs, out.draws_table(3), out.draws_about(3), quick=True)
    return out.draws_table(3).read_bytes()


def test_a_sweep_that_goes_on_gives_the_same_bytes(swept):
    before, middle = join(swept), swept.draw(3, "draw_001")
    kept = middle.read_bytes()
    middle.unlink()
    run_draw(Paths(), "draw_001", 3, middle, swept.draw_cost(3, "draw_001"), quick=True)
    assert middle.read_bytes() == kept
    assert join(swept) == before
    about = read_json(swept.draws_about(3))
    assert about["command"] == "snakemake draws --config draws=3 quick=True"
    assert about["draws"] == 3
    assert about["cpu_s"] > 0


def test_the_default_gripper_stands_beside_the_draws_and_is_none_of_them(swept):
    join(swept)
    rows = read_csv(swept.draws_table(3), ["draw"])[1]
    sweep = Sweep.of(rows)
    assert sweep.names == tuple(draw_names(3))
    assert rows[-1]["draw"] == DEFAULT and rows[-1]["gripper.height_mm"] == ""
    told = read_json(swept.draw(3, DEFAULT))
    read = {one["row"]: one["value"] for one in told["readings"]}
    assert told["values"] == {}
    assert sweep.of_default(ROW_BY_NAME["plate"]) == pytest.approx(read["plate"], rel=1e-5)
    assert sweep.of_default(ROW_BY_NAME["objects"]) is None


def test_draws_differ_and_say_what_they_read(swept):
    for name in draw_names(3):
        one = read_json(swept.draw(3, name))
        read = {reading["row"] for reading in one["readings"]}
        assert (read, one["missing"]) == ({"plate"}, {})
        assert one["values"] == values_of(int(name[-3:]), 3)
        assert (one["scenes"], one["refused"]) == (12, 0)
    assert len({swept.draw(3, name).read_bytes() for name in draw_names(3)}) == 3


@pytest.mark.slow
def test_a_draw_reads_every_row_or_says_why_not(tmp_path):
    run_draw(Paths(), "draw_001", 3, tmp_path / "draw.json", tmp_path / "cost.json", quick=True)
    one = read_json(tmp_path / "draw.json")
    read = {reading["row"] for reading in one["readings"]}
    lost = {row.name for row in ROWS if row.dataset in one["missing"]}
    assert read | lost == {row.name for row in ROWS}
    assert not read & lost


def test_the_kept_table_becomes_a_page(tmp_path):
    paths = Paths(tmp_path)
    folder = paths.reports / "draws"
    sweep, table, about = made_up(11), folder / "draws.csv", folder / "draws.json"
    rows = [
        {"draw": name, **{key: repr(float(column[n])) for key, column in sweep.columns.items()}}
        for n, name in enumerate(sweep.names)
    ]
    write_bytes(table, csv_bytes(list(rows[0]), rows))
    write_bytes(
        about, b'{"quick": false, "command": "c", "code": "d", "seed": 1, "cpu_s": 9,'
        b' "git_commit": ["abc"]}',
    )  # fmt: skip
    assert kept_files(paths) == []  # not the tables of another sweep, which the package has
    draws_tables(paths, table, about, folder / "tables.json")
    assert kept_files(paths) == [folder / "tables.json", table, about]
    known, tables = read_tables(folder / "tables.json")
    assert known["git_commit"] == "abc"
    assert [one.name for one in tables][:2] == ["draws_rows", "draws_agreement"]
    write_bytes(table, b"draw,size_known.cnn\ndraw_000,1\n" * 1 + b"draw_001,2\n" * 6)
    with pytest.raises(DataError, match="is not of today's draws"):
        draws_tables(paths, table, about, folder / "tables.json")


def test_the_kept_tables_are_of_the_kept_draws_and_of_todays_paper():
    tables, draws, about = kept_files(Paths())
    known, kept = read_tables(tables)
    assert known["of_sha256"] == hashlib.sha256(draws.read_bytes()).hexdigest()
    assert known["command"] == read_json(about)["command"]
    paper = {name: one.value for name, one in parse_paper(read_paper(Paths())).items()}
    rows = {row["row"]: row for one in kept if one.name == "draws_rows" for row in one.rows}
    assert set(rows) == {row.title for row in ROWS}
    for row in ROWS:
        target = paper[row.paper] if row.target is None else row.target
        assert rows[row.title]["paper"] == target
    assert set(read_csv(draws)[0]) >= {one.setting for one in drawn_parameters()}


def test_a_table_of_draws_keeps_what_is_missing():
    reading = {"row": "plate", "model": "cnn", "value": 90.0, "sd": 3.0, "chance": 25.0, "step": 6}
    both = [
        {
            "name": "draw_000",
            "scenes": 5,
            "refused": 0,
            "values": {"a": 1.5},
            "readings": [reading],
        },
        {"name": "draw_001", "scenes": 4, "refused": 1, "values": {"a": 2.5}, "readings": []},
    ]
    header, rows = joined(both)
    assert header[:4] == ["draw", "scenes", "refused", "a"]
    assert rows[0]["plate.cnn"] == "90"
    assert rows[1]["plate.cnn"] == ""
    assert np.isnan(Sweep.of(rows).columns["plate.cnn"][1])
