"""`ajgdata validate`: issues of recordings and of recordings.csv, through the command."""

import numpy as np
from worlds import assert_one_line

import ajgdata as library


def issues(out):
    """Recording, level and code of each line of the table that `validate` prints."""
    lines = out.splitlines()
    table = lines[1 : lines.index("")] if "" in lines else []
    return [tuple(line.split()[:3]) for line in table]


def test_an_invalid_cell_excludes_the_recording_from_its_target_only(ajgdata, project):
    number = {"kind": "regression"}
    project.declare(targets={"edge_mm": number, "other": {"kind": "classification"}})
    project.session("s1", {"a": 500.0, "b": 750.0, "c": 900.0})
    rows = [("a", "1", "x"), ("b", "wide", "y"), ("c", "3", "")]
    head = "recording_id,file,grasp_id,edge_mm,other\n"
    body = "".join(f"{name},audio/{name}.wav,{name},{edge},{o}\n" for name, edge, o in rows)
    (project.folder() / "recordings.csv").write_text(head + body)
    code, out, _ = ajgdata("validate", "d")
    assert (code, issues(out)) == (1, [("s1/b", "warning", "bad_label")])
    assert "edge_mm = 'wide' is not a finite number: no task of edge_mm uses it" in out
    spec_targets = library.load_dataset("d", project.root).spec.targets
    project.shard()
    project.merge("s1", targets=dict(spec_targets))
    with library.load_features("d", project.root) as features:
        assert features.other.values.tolist() == ["x", "y", ""]
        np.testing.assert_array_equal(features.edge_mm, [1, np.nan, 3])


def test_settings_of_an_experiment_have_file_and_line(ajgdata, project):
    path = project.declare()
    path.write_text(
        path.read_text() + "tasks:\n"
        "  size:\n"
        "    target: edge_mm\n"
        "    experiments:\n"
        "      across_sessions: {}\n"
        "      learning_curve:\n"
        "        repeats: 2\n"
        "        groups: [0, 4]\n"
    )
    line = path.read_text().splitlines().index("        groups: [0, 4]") + 1
    code, _, error = ajgdata("validate", "d")
    assert code == 1
    assert_one_line(error, f"dataset.yaml:{line}: task size: experiments.learning_curve: groups")
