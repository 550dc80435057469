"""`ajgdata check` says what the workflow would quarantine, and changes nothing."""

import numpy as np
from worlds import assert_one_line, tone, write_tone

import ajgdata as library
from ajgdata.pipeline.label_counts import label_counts
from ajgdata.pipeline.label_issues import label_tables, placebo_issues, placement_notes
from ajgdata.pipeline.validate import validate_dataset
from ajgdata.store.audio import file_sha256
from ajgdata.store.findings import read_findings
from ajgdata.types import DatasetSpec
from ajgdata.types.features import feature_settings


def check(project):
    return validate_dataset(project.paths, "d")


def codes(findings):
    return [(f.session_id, f.recording_id, f.level, f.code) for f in findings]


def test_mistakes_of_sessions_and_labels(project):
    project.session("s0", {"a": 444.0})
    (project.folder("s0") / "session.yaml").unlink()
    rows = project.session("s1", {"d": 530.0, "e": 540.0, "f": 550.0})
    audio = project.folder() / "audio"
    (audio / "e.wav").write_bytes((audio / "f.wav").read_bytes())
    rows = [r.model_copy(update={"sha256": ""}) for r in rows]
    rows[0] = rows[0].model_copy(update={"labels": {"edge_mm": "ten"}})
    project.write(rows)
    checked, findings = check(project)
    assert checked == 3
    assert codes(findings) == [
        ("s0", "*", "error", "bad_session"),
        ("s1", "d", "warning", "bad_label"),
        ("s1", "d", "warning", "no_sha256"),
        ("s1", "e", "error", "two_labels"),
        ("s1", "e", "warning", "no_sha256"),
        ("s1", "f", "error", "two_labels"),
        ("s1", "f", "warning", "no_sha256"),
    ]
    assert all("\n" not in f.problem + f.fix and f.fix for f in findings)


def test_an_invalid_cell_excludes_the_recording_from_its_target_only(ajgdata, project):
    number = {"kind": "regression"}
    project.declare(targets={"edge_mm": number, "other": {"kind": "classification"}})
    project.session("s1", {"a": 500.0, "b": 750.0, "c": 900.0})
    rows = [("a", "1", "x"), ("b", "wide", "y"), ("c", "3", "")]
    sha256 = {name: file_sha256(project.folder() / f"audio/{name}.wav") for name, *_ in rows}
    head = "recording_id,file,sha256,grasp_id,edge_mm,other\n"
    body = "".join(f"{n},audio/{n}.wav,{sha256[n]},{n},{edge},{o}\n" for n, edge, o in rows)
    (project.folder() / "recordings.csv").write_text(head + body)
    code, out, _ = ajgdata("check", "d")
    assert (code, out.count("\n")) == (3, 4)
    problem = "edge_mm = 'wide' is not a finite number: no task of edge_mm uses it"
    assert out.startswith(f"warning bad_label s1/b: {problem}; ")
    spec_targets = library.load_dataset("d", project.root).spec.targets
    project.build("s1", targets=dict(spec_targets))
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
        "      conformal_intervals: {}\n"
        "      learning_curve:\n"
        "        repeats: 2\n"
        "        groups: [0, 4]\n"
    )
    line = path.read_text().splitlines().index("        groups: [0, 4]") + 1
    code, _, error = ajgdata("check", "d")
    assert code == 1
    assert_one_line(error, f"dataset.yaml:{line}: task size: experiments.learning_curve: groups")


def test_issues_of_several_data_sets_name_their_data_set(ajgdata, project):
    other = project.paths.dataset("other")
    project.declare()
    other.parent.mkdir()
    other.write_text("name: other\n")
    project.session("s1", {})
    code, out, _ = ajgdata("check", "d", "other")
    assert code == 3
    assert "no_recordings d/s1/*: " in out
    assert "no_sessions other/*/*: " in out
    assert "no_recordings s1/*: " in ajgdata("check", "d")[1]


def test_a_feature_of_the_played_sound_requires_this_sound(project):
    """`check` reports the errors of the next run."""
    features = {"kind": "transfer_function", "window": 64, "hop": 32, "least_coherence": 0}
    project.declare(features=features)
    rows = project.session("s1", {"a": 500.0, "b": 750.0})
    project.session("s2", {"c": 600.0})
    project.write(rows, "s1", excitation=project.excitation("s1", tone(300)))
    _, findings = check(project)
    assert codes(findings) == [("s2", "c", "error", "no_feature")]
    assert "no played sound" in findings[0].problem
    project.build("s1", "s2", features=feature_settings(features))
    (issue,) = [f for f in read_findings(project.paths.quarantine("d")) if f.level == "error"]
    assert issue == findings[0]
    lost = project.session("s3", {"d": 700.0})
    project.write(lost, "s3", excitation=project.excitation("s3", tone(250)))
    (project.folder("s3") / "excitation.wav").unlink()
    errors = [f for f in check(project)[1] if f.level == "error"]
    assert [(f.recording_id, f.code) for f in errors] == [("c", "no_feature"), ("d", "no_feature")]


def test_a_played_file_that_is_missing_is_a_warning(project):
    project.declare(excitation={"kind": "file", "file": "sounds/chirp.wav"})
    project.session("s1")
    (warning,) = check(project)[1]
    assert codes([warning]) == [("dataset.yaml", "*", "warning", "played_sound")]
    assert "chirp.wav" in warning.problem
    write_tone(project.root / "sounds" / "chirp.wav", 400.0)
    assert check(project)[1] == []


def test_references_are_not_grasps(project):
    rows = project.session("s1")
    labels = {**rows[0].labels, "reference": "empty"}
    project.write([rows[0].model_copy(update={"labels": labels}), *rows[1:]])
    facts = label_counts(label_tables(project.paths, "d"), {})
    assert (facts["recordings"], facts["grasps"], facts["references"]) == ("2", "2", "1")


def test_classes_that_are_placements_are_a_note_with_what_to_record():
    targets = {"kind": {"kind": "classification"}, "edge": {"kind": "regression"}}
    tasks = {"kind": {"target": "kind"}, "edge": {"target": "edge"}}
    content = {"name": "d", "targets": targets, "tasks": tasks, "placebo": ["x"]}
    spec = DatasetSpec.model_validate(content)

    def row(name, kind, placement, held="cube"):
        return {
            "recording_id": name,
            "grasp_id": name,
            "placement_id": placement,
            "sample": "0",
            "object": held,
            "quality": "ok",
            "kind": kind,
            "edge": "1",
        }

    rows = [row("1", "a", "p"), row("2", "a", "p"), row("3", "b", "q"), row("4", "b", "q")]
    (note,) = placement_notes({"s": rows, "t": rows}, spec)
    assert (note.level, note.code) == ("note", "placement")
    assert note.problem.startswith("task kind: each class has one placement per session")
    assert "in rounds" in note.fix
    more = [row("5", "a", "p2"), row("6", "b", "q2")]
    assert placement_notes({"s": [*rows, *more], "t": rows}, spec) == []
    # placements of the placebo are not those of a class
    other = [row("5", "a", "p2", "x"), row("6", "b", "q2", "x")]
    assert len(placement_notes({"s": [*rows, *other], "t": rows}, spec)) == 1
    in_sessions = {**content, "tasks": {"kind": {"target": "kind", "groups": "session_id"}}}
    assert placement_notes({"s": rows}, DatasetSpec.model_validate(in_sessions)) == []


def test_a_placebo_that_was_not_recorded_is_a_warning():
    spec = DatasetSpec.model_validate({"name": "d", "placebo": ["x", "y"]})
    rows = [{"object": name} for name in ("x", "ball")]
    (issue,) = placebo_issues({"s": rows}, spec)
    assert (issue.level, issue.problem) == ("warning", "placebo: no recording has the object y")
    assert placebo_issues({"s": [*rows, {"object": "y"}]}, spec) == []
    assert placebo_issues({}, spec) == []
