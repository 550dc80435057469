"""The command: exit codes, printed summaries, and one line per user error."""

import errno
import re
import sys

import pytest
from worlds import assert_one_line, write_tone

from ajgdata.cli.project import diagnostics
from ajgdata.pipeline.jobs import logged
from ajgdata.store.sessions import read_dataset
from ajgdata.types.shell import shell_quoted


def test_check_clean_and_not(ajgdata, project, snapshot):
    project.session()
    before = snapshot(project.root)
    assert ajgdata("check", "d") == (0, "3 recordings checked: 0 errors, 0 warnings, 0 notes\n", "")
    assert snapshot(project.root) == before
    (project.folder() / "audio" / "b.wav").unlink()
    code, out, err = ajgdata("check")
    assert (code, err) == (3, "")
    lines = out.splitlines()
    assert lines[0] == (
        "error missing s1/b: no such file, or a broken link; restore it or remove its row"
    )
    assert lines[-1] == "3 recordings checked: 1 error, 0 warnings, 0 notes"
    assert lines[-3:-1] == [
        "missing 1",
        "see and hear: ajgdata browse d --check --filter " + shell_quoted("issue=missing"),
    ]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["check", "nope"], "no such data set. Use one of d"),
        (
            ["record", "d", "--device", "x"],
            "has no protocol. Add one, as in https://ajgdata.github.io/ajgdata/tutorial.html",
        ),
        (["import", "nowhere", "--dataset", "d"], "nowhere: is not a folder"),
        (["import", "audio", "--dataset", "d", "--pattern", "("], "--pattern: not a regular"),
        (["import", "audio", "--dataset", "d", "--table", "t", "--file", "{x}"], "no such file"),
        (["import", "audio", "--dataset", "../up"], "Use letters, digits, _ and -, up"),
    ],
)
def test_mistakes_are_one_line(ajgdata, project, arguments, said):
    write_tone(project.root / "audio" / "1_a.wav", 500)
    code, out, err = ajgdata(*arguments)
    assert (code, out) == (1, "")
    assert_one_line(err, said)
    assert not (project.root / "data").exists()


def test_a_job_without_space_ends_with_a_line_and_keeps_the_traceback_in_its_log(tmp_path):
    log = tmp_path / "log"
    with pytest.raises(SystemExit) as ended, logged(str(log)):
        raise OSError(errno.ENOSPC, "No space left on device", "store.nc")
    assert ended.value.code == "store.nc: No space left on device. Free some space on its disk."
    assert "Traceback" in log.read_text()


def test_outside_a_project(ajgdata, monkeypatch):
    monkeypatch.chdir("/")
    code, _, err = ajgdata("check")
    assert code == 1
    assert_one_line(err, "no project at /")


def test_import_says_what_it_did(ajgdata, project):
    write_tone(project.root / "audio" / "1_a [x].wav", 500)
    write_tone(project.root / "audio" / "2_b.wav", 510)
    write_tone(project.root / "audio" / "odd :smile:.wav", 520)
    command = ("import", "audio", "--dataset", "e")
    code, out, err = ajgdata(*command)
    assert (code, err) == (0, "")
    assert out.splitlines() == [
        "2 added, 0 changed, 0 unchanged in 1 session(s) of e",
        "not used odd :smile:.wav: does not match the pattern",
        "note target label: a class (2 distinct texts)",
        "note stored, but not a target: n",
        f"now declared in {project.root}/datasets/e/dataset.yaml: 8000 Hz, one microphone, targets "
        "label",
        "recordings            2",
        "objects               2",
        "grasps                2",
        "samples per grasp     1 (2 grasps)",
        "recordings per label  a [x] 1, b 1",
        "models: linear and k-NN; to train the CNN too, add `cnn` to `models` of a task",
        "next: ajgdata check e, then ajgdata run e",
    ]
    assert read_dataset(project.paths, "e").imports.pattern == "starter-kit"
    write_tone(project.root / "audio" / "1_a [x].wav", 530)
    out = ajgdata(*command)[1]
    assert "kept 1_a [x]: has different bytes in the folder." in out


def test_an_import_that_could_not_do_all_says_so_in_its_exit_code(ajgdata, project):
    write_tone(project.root / "audio" / "1_a.wav", 500)
    (project.root / "audio" / "2_b.wav").symlink_to(".git/annex/objects/2.wav")
    again = ("import", "audio", "--dataset", "e")
    code, out, _ = ajgdata(*again)
    assert code == 3
    assert "1 added" in out
    assert "failed 2_b.wav: not a file, or a broken link" in out
    (project.root / "audio" / "2_b.wav").unlink()
    assert ajgdata(*again)[0] == 0


def test_doctor_lists_versions_and_the_project(project):
    facts = diagnostics(project.paths)
    assert facts["python"].startswith(".".join(map(str, sys.version_info[:3])))
    assert re.search(r"numpy \d+\.\d+", facts["packages"])
    assert facts["extras"].startswith("workflow, cnn, audio, simulate")
    assert facts["project"] == str(project.root)
    assert diagnostics(None)["project"] == "none here or above"
