"""Designs of a gripper: ranges become designs, and the better of two is ranked first."""

import numpy as np
import pytest
import yaml
from drawn_figures import fits
from typer.testing import CliRunner

from ajgdata.cli.main import app
from ajgdata.design.compare import (
    Compared,
    DesignSpec,
    compare_designs,
    designs_of,
    ranked,
    scenes_of,
    skills,
    stratified,
)
from ajgdata.design.readings import Reading
from ajgdata.design.recordings import merged
from ajgdata.design.rows import REDUCED, reduced
from ajgdata.paths import Paths
from ajgdata.pipeline.design import read_design
from ajgdata.report.blocks import Illustration
from ajgdata.report.canvas import draw
from ajgdata.report.design_figure import design_figure, design_finding
from ajgdata.report.format import Caption
from ajgdata.store.sessions import read_dataset
from ajgdata.types import DataError

TWO = {"good": {}, "bad": {"gripper": {"height_mm": 40}}}


def reading(loss: np.ndarray, row: str = "size_withheld", chance: float = 6.0) -> Reading:
    names = tuple(f"grasp_{number:02d}" for number in range(len(loss)))
    value = float(np.sqrt(loss.mean()))
    return Reading(row, value, chance, names, tuple(loss))


def compared(name: str, loss: np.ndarray, seconds: float = 2.0) -> Compared:
    return Compared(name, TWO.get(name, {}), {"size_withheld": reading(loss)}, 20, seconds)


def test_ranges_become_stratified_designs_beside_those_named():
    spec = DesignSpec(
        designs={"mine": {"medium": {"kind": "coffee"}}},
        ranges={"gripper.bed_depth_mm": (25, 45), "excitation.high_hz": (8_000, 20_000)},
        choices={"medium.kind": ["plastic", "coffee"]},
        draws=4,
    )
    found = designs_of(spec)
    assert list(found) == ["mine", "drawn_00", "drawn_01", "drawn_02", "drawn_03"]
    drawn = [found[f"drawn_{number:02d}"] for number in range(4)]
    depths = [one["gripper"]["bed_depth_mm"] for one in drawn]
    assert sorted((np.array(depths) - 25) // 5) == [0, 1, 2, 3]
    assert sorted(one["medium"]["kind"] for one in drawn) == ["coffee"] * 2 + ["plastic"] * 2
    assert all(8_000 <= one["excitation"]["high_hz"] <= 20_000 for one in drawn)
    assert designs_of(spec) == found


@pytest.mark.parametrize("count", [1, 3, 20])
def test_each_column_is_stratified_and_the_same_each_time(count):
    column = stratified(count, "gripper.bed_depth_mm", 5)
    assert sorted((column * count).astype(int)) == list(range(count))
    np.testing.assert_array_equal(column, stratified(count, "gripper.bed_depth_mm", 5))
    assert not np.array_equal(column, stratified(count, "gripper.bed_depth_mm", 6))


def test_columns_of_two_settings_are_independent():
    one, other = stratified(400, "a", 0), stratified(400, "b", 0)
    assert abs(np.corrcoef(one, other)[0, 1]) < 4 / np.sqrt(400)  # four standard errors


def test_settings_are_merged_at_all_depths():
    assert merged({"a": {"b": [1]}}, {"a": {"b": [2]}, "c": 3}) == {"a": {"b": [2]}, "c": 3}


@pytest.mark.parametrize("dataset", REDUCED)
def test_every_data_set_has_a_reduced_recipe(dataset):
    spec = read_dataset(Paths(), dataset)
    assert set(REDUCED[dataset].left_out) <= {one.name for one in spec.recipe.objects}
    assert REDUCED[dataset].task in spec.tasks
    amount = {"sessions": 2, "grasps": 2, "samples": 1}
    quick = reduced(spec.recipe, REDUCED[dataset], **amount, quick=True)
    assert quick.sessions == 1
    whole = reduced(spec.recipe, REDUCED[dataset], **amount)
    assert (whole.sessions, whole.grasps_per_object, whole.samples_per_grasp) == (2, 2, 1)
    assert len(quick.objects) <= len(whole.objects) <= len(spec.recipe.objects)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"designs": {"one": {}}}, "two designs at least"),
        ({"ranges": {"gripper.colour": [0, 1]}}, "gripper.colour is no setting"),
        ({"designs": TWO, "rows": ["coffee"]}, "unknown row 'coffee'"),
        ({"designs": TWO, "grasp": 3}, "unknown key grasp"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(tmp_path, wrong, said):
    path = tmp_path / "spec.yaml"
    path.write_text(yaml.safe_dump(wrong))
    with pytest.raises(DataError, match=said):
        read_design(path)


def test_the_better_design_is_first_with_its_uncertainty():
    rng = np.random.default_rng(0)
    common = rng.exponential(1.0, 40)
    spec = DesignSpec(designs=TWO, rows=["size_withheld"])
    both = [compared("bad", 2.25 * common), compared("good", common)]
    table = ranked(both, spec)
    # Of the same grasps: twice the scatter of a grasp is in both, and 1.5 times the error is sure.
    assert table.column("design") == ["good", "bad"]
    assert table.column("first") == [100.0, 0.0]
    skill = 1 - np.sqrt(common.mean()) / 6
    assert table.rows[0]["skill"] == pytest.approx(skill)
    assert table.rows[0]["low"] < skill < table.rows[0]["high"]
    # Delta method: half the relative standard error of the mean, of an error of (1 - skill).
    error = (1 - skill) * 0.5 * common.std() / common.mean() / np.sqrt(40)
    assert table.rows[0]["high"] - table.rows[0]["low"] == pytest.approx(3.92 * error, rel=0.25)
    drawn = draw(Illustration("designs", Caption("", ""), lambda: design_figure(table)))
    assert fits(drawn)
    assert design_finding(table) == "good is read best, in 100 % of bootstrap samples"


def test_a_slow_design_is_worth_less_a_second_and_one_that_cannot_is_last():
    loss = np.full(10, 4.0)
    spec = DesignSpec(designs=TWO, rows=["size_withheld"])
    three = [
        Compared("cannot", {}, {}, 0, 0.0, "it pinches the cavity"),
        compared("slow", 0.9 * loss, 20.0),
        compared("fast", loss, 2.0),
    ]
    assert ranked(three, spec).column("design") == ["slow", "fast", "cannot"]
    table = ranked(three, spec, "per_second")
    assert table.column("design") == ["fast", "slow", "cannot"]
    assert table.rows[0]["per_second"] == pytest.approx((1 - 2 / 6) / 0.1)
    assert table.rows[2]["skill"] is None
    assert table.rows[2]["missing"] == "it pinches the cavity"


def test_skill_of_classes_is_what_is_above_chance():
    half = reading(np.array([0.0, 1.0] * 8), "sphere80", chance=25.0)
    one = Compared("one", {}, {"sphere80": half}, 1, 1.0)
    told, _ = skills([one], ("sphere80",), 0)
    assert told[0] == pytest.approx((50 - 25) / 75)


def test_a_gripper_that_hears_is_ranked_before_one_that_does_not():
    """A planted design: its level is so low that nothing but the microphone's noise is heard."""
    spec = DesignSpec(
        designs={"deaf": {"signal": {"level_db_spl": 0}}, "hears": {}},
        rows=["plate"], sessions=1, quick=True,
    )  # fmt: skip
    specs = {"plate": read_dataset(Paths(), "plate")}
    assert scenes_of(spec, specs) == 12
    table = ranked(compare_designs(spec, specs), spec)
    assert table.column("design") == ["hears", "deaf"]
    assert table.rows[0]["first"] > 90
    assert table.rows[0]["plate"] > table.rows[1]["plate"] + 20


def test_looking_lists_designs_and_solves_nothing(tmp_path):
    path = tmp_path / "two.yaml"
    path.write_text(yaml.safe_dump({"designs": TWO, "rows": ["size_withheld"]}))
    done = CliRunner().invoke(app, ["gripper", "design", str(path), "--dry-run"])
    assert done.exit_code == 0
    assert "gripper.height_mm = 40" in done.output
    assert "2 designs of 48 scenes each: about 0.2 min of a core" in done.output
    assert list(tmp_path.iterdir()) == [path]
