"""Patterns that the import prints read the values of the file names exactly, with their signs."""

import re
import shlex
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sounds import resonances, write_wav

from ajgdata.store.file_names import ambiguous_readings, name_form
from ajgdata.store.file_names import unused_parts as unused_parts_of_matches
from ajgdata.store.scan import scan
from ajgdata.store.sessions import read_dataset
from ajgdata.types import ImportSettings


def unused_parts(pattern, files):
    matches = [pattern.fullmatch(path.as_posix()) for path in files]
    return unused_parts_of_matches([match for match in matches if match])


def write(src, names):
    for number, name in enumerate(names):
        write_wav(src / name, resonances(0, number, frames=2_000))


def printed_options(out):
    """Return the options of each printed proposal, as a shell reads them."""
    lines = [line.partition("   (")[0] for line in out.splitlines() if line.startswith("  --pat")]
    return [shlex.split(line) for line in lines]


def proposals(ajgdata, src):
    """Return the options that the import prints, which reads nothing."""
    printed = ajgdata("import", src, "--dataset", "mine")
    assert printed.code == 1
    assert printed.err.count("\n") == 1
    return printed_options(printed.out), printed


ANGLES = {
    "bar_{}_{:02d}.wav": ("-30", "-20", "-10", "10", "20", "30"),
    "bar {} {:02d}.wav": ("-30", "+10"),
    "bar_{}_{:02d}.flac": ("-7.5", "0", "+7.5"),
    "bar{}_{:02d}.wav": ("-30", "+10"),
    "angle{}-{}.wav": ("-30", "0", "15"),
    "{}_{}_x.WAV": ("-30", "30.25"),
    "{}/g{}.wav": ("-30", "30"),
    "bar_{}deg_{}.wav": ("-30", "30"),
    "bar_{}_rep{}.wav": ("-30", "none", "+15"),
    "bar_{}_take{}.wav": ("7p5", "m7p5", "10p0"),
    "object=bar,angle={},n={}.wav": ("-5", "7.5", "10"),
    "bar_{}_g{}.wav": ("7,5", "10,0"),
}


@pytest.mark.parametrize("template", ANGLES)
def test_the_first_printed_pattern_reads_signs_and_decimals(ajgdata, src, rows, template):
    angles = ANGLES[template]
    write(src, [template.format(angle, i) for angle in angles for i in (1, 2, 3)])
    options, _ = proposals(ajgdata, src)
    assert ajgdata("import", src, "--dataset", "mine", *options[0]).code == 0
    labels = [row["label"] for row in rows("mine")]
    assert {label: labels.count(label) for label in labels} == dict.fromkeys(angles, 3)


def test_a_minus_sign_is_read_as_the_number_that_it_writes(ajgdata, paths, src, rows):
    angles = [str(angle).replace("-", "\u2212") for angle in range(-60, 61, 10)]
    write(src, [f"bar_{angle}_{i}.wav" for angle in angles for i in (1, 2)])
    options, _ = proposals(ajgdata, src)
    assert ajgdata("import", src, "--dataset", "mine", *options[0]).code == 0
    assert sorted({float(row["label"]) for row in rows("mine")}) == list(range(-60, 61, 10))
    assert read_dataset(paths, "mine").targets["label"].kind == "regression"


def test_an_ambiguous_hyphen_is_a_separator_and_is_reported(ajgdata, src, rows):
    write(src, [f"bar-{angle}-{i}.wav" for angle in (10, 20) for i in (1, 2)])
    options, printed = proposals(ajgdata, src)
    assert "a hyphen after a letter is read as a separator, e.g. 'bar-10-1.wav'" in printed.out
    assert ajgdata("import", src, "--dataset", "mine", *options[0]).code == 0
    assert {row["label"] for row in rows("mine")} == {"10", "20"}
    # the change that the note describes
    signed = r"bar(?P<label>-?\d+)-(?P<grasp>\d+)\.[^./]+"
    assert signed.replace(r"(?P<label>-?", r"-(?P<label>") in options[0][1].replace(
        r"(?:\.\d+)?", ""
    )
    assert ajgdata("import", src, "--dataset", "signed", "--pattern", signed).code == 0
    assert {row["label"] for row in rows("signed")} == {"-10", "-20"}


def test_the_second_of_two_hyphens_is_a_sign_and_is_reported(ajgdata, src, rows):
    write(src, [f"bar-{angle}-{i}.wav" for angle in (-20, -10) for i in (1, 2)])
    options, printed = proposals(ajgdata, src)
    assert "the second of two hyphens before a number is read as a sign" in printed.text
    assert ajgdata("import", src, "--dataset", "mine", *options[0]).code == 0
    assert {row["label"] for row in rows("mine")} == {"-20", "-10"}


def test_an_underscore_that_could_be_a_decimal_point_is_reported(ajgdata, src, rows):
    write(src, [f"bar_{position}_rep{i}.wav" for position in ("7_5", "8_0") for i in (1, 2)])
    _, printed = proposals(ajgdata, src)
    assert "numbers with _ between them are two fields, e.g. 'bar_7_5_rep1.wav'" in printed.out
    pattern = r"bar_(?P<label>\d+_\d+)_rep(?P<take>\d+)\.wav"
    assert ajgdata("import", src, "--dataset", "mine", "--pattern", pattern).code == 0
    assert {row["label"] for row in rows("mine")} == {"7_5", "8_0"}


def test_hyphens_before_counters_with_zeros_are_no_question(ajgdata, src):
    write(src, [f"take-{label}-{i:03d}.wav" for label in ("bar", "ball") for i in (1, 2)])
    options, printed = proposals(ajgdata, src)
    assert "hyphen" not in printed.out
    assert options[0][1] == r"take-(?P<label>[^/_. -]+)-(?P<grasp>\d+)\.[^./]+"


LAYOUTS = {
    "{label}_g{grasp}_s{sample}.wav": ["label", "grasp", "sample"],
    "s{sample}_{label}_g{grasp}.wav": ["label", "grasp", "sample"],
    "{label}_grasp{grasp}_rep{sample}.wav": ["label", "grasp", "sample"],
    "{label}_{grasp}_take{sample}.wav": ["label", "grasp", "sample"],
    "day{session}/{label}/{grasp}.wav": ["label", "grasp", "session"],
    "{label}/day{session}/{grasp}.wav": ["label", "grasp", "session"],
    "2026-01-0{session}/{label}/g{grasp}/{sample}.wav": ["label", "grasp", "sample", "session"],
    "day{session}/{label}{grasp}.wav": ["label", "grasp", "session"],
    "{label}{grasp}.wav": ["label", "grasp"],
    "grasp-{grasp}_object-{label}_rep-{sample}.wav": ["label", "grasp", "sample"],
    "{label}/{grasp}/{sample}.wav": ["label", "grasp", "sample"],
    "session_{session}_{label}_{grasp}.wav": ["label", "grasp", "session"],
    "obj{object}_{label}_g{grasp}_s{sample}.wav": ["label", "grasp", "sample", "object"],
}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_roles_that_words_and_folders_specify(tmp_path, layout):
    values = [
        {"label": label, "grasp": grasp, "sample": sample, "session": session, "object": number}
        for number, label in enumerate(("cube", "ball"), 1)
        for grasp in (1, 2, 3)
        for sample in ((1, 2) if "{sample}" in layout else (1,))
        for session in ((1, 2) if "{session}" in layout else (1,))
    ]
    form = name_form([Path(layout.format(**value)) for value in values])
    pattern = re.compile(form.pattern(form.proposals()[0]))
    assert set(pattern.groupindex) == set(LAYOUTS[layout])
    assert form.grasp_template(form.proposals()[0]) == ""
    for value in values:
        match = pattern.fullmatch(layout.format(**value))
        read = {
            role: match[role].removeprefix("day").removeprefix("2026-01-0")
            for role in LAYOUTS[layout]
        }
        assert read == {role: str(value[role]) for role in LAYOUTS[layout]}


@pytest.mark.parametrize("folders", [("day1", "day2"), ("2026-01-01", "2026-01-02"), ("x", "x")])
def test_folders_of_days_are_no_labels(ajgdata, src, folders):
    write(
        src, sorted({f"{d}/{o}_{i}.wav" for d in folders for o in ("bar", "can") for i in (1, 2)})
    )
    options, printed = proposals(ajgdata, src)
    assert "(the folder is the label)" not in printed.out
    assert ("(?P<session>[^/]+)/" in options[0][1]) == (folders[0] != folders[1])


def test_a_number_that_differs_in_each_file_leaves_no_sample():
    names = [
        Path(f"{n}_{o}_hit{h}.wav") for n, (o, h) in enumerate(zip("aabb", "1212", strict=True))
    ]
    form = name_form([Path(f"x{path}") for path in names])
    (label,) = [span for span, role in form.proposals()[0].items() if role == "label"]
    assert form.values(label, "label") == ("a", "a", "b", "b")
    assert sorted(form.proposals()[0].values()) == ["field_3", "grasp", "label"]


def test_folders_of_days_become_sessions_and_share_no_grasp(ajgdata, src, rows):
    names = [f"day{d}/{o}/{i:02d}.wav" for d in (1, 2) for o in ("cube", "ball") for i in (1, 2)]
    write(src, names)
    options, _ = proposals(ajgdata, src)
    assert ajgdata("import", src, "--dataset", "mine", *options[0]).code == 0
    for day in ("day1", "day2"):
        assert [row["label"] for row in rows("mine", day)] == ["ball", "ball", "cube", "cube"]


def test_numbers_of_grasps_that_begin_again_are_completed_by_a_template(ajgdata, src, rows):
    repeats = [f"g{grasp}_s{sample}" for grasp in (1, 2) for sample in (1, 2)]
    write(src, [f"{o}_{a}_{r}.wav" for o in ("bar", "can") for a in (-30, 30) for r in repeats])
    options, _ = proposals(ajgdata, src)
    assert options[0][2:] == ["--grasp", "{label}/{field_2}/{grasp}"]
    assert ajgdata("import", src, "--dataset", "mine", *options[0]).code == 0
    imported = rows("mine")
    assert len({row["grasp_id"] for row in imported}) == 8
    assert len({(row["grasp_id"], row["sample"]) for row in imported}) == 16
    assert {row["field_2"] for row in imported} == {"-30", "30"}


TEXTS = st.lists(
    st.sampled_from(["cube", "ball", "bar", "Größe", "can"]), min_size=2, max_size=3, unique=True
)
NUMBERS = st.lists(
    st.one_of(
        st.integers(-90, 90).map(str),
        st.integers(-90, 90).map("{:+d}".format),
        st.integers(-900, 900).map(lambda tenths: f"{tenths / 10:.1f}"),
        st.integers(-90, -1).map(lambda angle: f"\u2212{-angle}"),
    ),
    min_size=2,
    max_size=4,
    unique=True,
)
FORMS = (
    "{text}_{number}_{count:02d}.wav",
    "{number}_{text}_{count}.wav",
    "{text}/{number}/{count}.wav",
    "day{day}/{text}/{number}_g{count}.wav",
    "{text}/day{day}/{number} {count}.wav",
    "x_{number}mm_{text}_s{count}.flac",
    "{text}.{number}_{count:03d}.wav",
)
#: Without a separator, or with a hyphen that could be a sign.
AMBIGUOUS_FORMS = ("{text}-{number}-g{count}.wav", "{text}{number}_{count}.wav")


def generated(template, texts, numbers, days):
    """Return the values of each name; `count` as it is written."""
    width = 3 if ":03d" in template else 2 if ":02d" in template else 1
    return {
        Path(template.format(text=text, number=number, count=count, day=day)): {
            "text": text,
            "number": number,
            "count": f"{count:0{width}d}",
            "day": f"day{day}",
        }
        for text in texts
        for number in numbers
        for count in (1, 2)
        for day in days
    }


@settings(max_examples=100, deadline=None)
@given(st.sampled_from(FORMS), TEXTS, NUMBERS)
def test_each_proposal_reads_the_values_that_names_were_generated_from(template, texts, numbers):
    has_days = "{day}" in template
    names = ["text", "number", "count", *(["day"] if has_days else [])]
    days = (1, 2) if has_days else (1,)
    by_path = generated(template, texts, numbers, days)
    form = name_form(list(by_path))
    assert form.other_files == ()
    assert form.proposals()
    for roles in form.proposals():
        pattern = re.compile(form.pattern(roles))
        assert unused_parts(pattern, list(by_path)) == []
        for path, value in by_path.items():
            read = pattern.fullmatch(path.as_posix()).groupdict()
            assert set(read.values()) == {value[name] for name in names}


@pytest.mark.parametrize("template", FORMS)
def test_the_import_reads_each_proposal_exactly(src, template):
    days = (1, 2) if "{day}" in template else (1,)
    by_path = generated(template, ("bar", "can"), ("-30", "+7.5", "\u221212", "0"), days)
    for path in by_path:
        (src / path).parent.mkdir(parents=True, exist_ok=True)
        (src / path).touch()
    form = name_form(list(by_path))
    assert len(form.proposals()) > 1
    for roles in form.proposals():
        options = ImportSettings(pattern=form.pattern(roles), grasp=form.grasp_template(roles))
        result = scan(src, options, "d")
        assert not result.remarks["unused"]
        assert not result.remarks["not used"]
        assert len(result.files) == len(by_path)
        (label,) = [span for span, role in roles.items() if role == "label"]
        expected = dict(zip(form.files, form.values(label, "label"), strict=True))
        for file in result.files:
            texts = {text.replace("\u2212", "-") for text in by_path[file.path].values()}
            assert file.labels["label"] == expected[file.path].replace("\u2212", "-")
            assert file.labels["label"] in texts
        recordings = {(f.session, f.cells["grasp_id"], f.cells["sample"]) for f in result.files}
        assert len(recordings) == len(by_path)


@settings(max_examples=100, deadline=None)
@given(st.sampled_from(AMBIGUOUS_FORMS), TEXTS, NUMBERS)
def test_a_sign_in_an_ambiguous_place_is_read_or_reported(template, texts, numbers):
    by_path = generated(template, texts, numbers, (1,))
    form = name_form(list(by_path))
    assert form.proposals()
    for roles in form.proposals():
        pattern = re.compile(form.pattern(roles))
        for path in form.files:
            read = set(pattern.fullmatch(path.as_posix()).groupdict().values())
            value = by_path[path]
            if value["number"] in read:
                continue
            unsigned = value["number"].removeprefix("-")
            if f"{value['text']}{value['number']}" in read:  # `cube10` is one text
                assert unsigned == value["number"]
            else:
                assert unsigned in read
                assert "a hyphen after a letter is read as a separator" in " ".join(
                    ambiguous_readings(form)
                )


@pytest.mark.parametrize(
    ("pattern", "parts"),
    [
        (r"(?P<label>[a-z]+)_.*", [["_10_1", "_10_2", "_20_1", "_20_2"]]),
        (r"(?P<label>[a-z]+)_\d+_\d\.wav", [["_10_1", "_10_2", "_20_1", "_20_2"]]),
        (r"(?P<label>[a-z]+)_(?P<grasp>\d+)_(?:\d)\.wav", [["_1", "_2"]]),
        (r"(?P<label>[a-z]+)_(\d+)_(?P<grasp>\d)\.(?:wav|flac)", [["_10_", "_20_"]]),
        (r"\w+?_(?P<label>\d+_\d)\.\w+", [["ball_", "cube_"]]),
        (r"(?P<label>[a-z]+)_(?P<n>\d+_\d)\..+", []),
        (r"(?P<object>(?P<label>[a-z]+)_\d+)_(?P<n>\d).+", []),
        (r"(?P<path>.+)", []),
    ],
)
def test_unused_parts_of_names(pattern, parts):
    texts = [f"{o}_{a}_{i}" for o in ("cube", "ball") for a in (10, 20) for i in (1, 2)]
    files = [Path(text + (".flac" if text[0] == "b" else ".wav")) for text in texts]
    assert unused_parts(re.compile(pattern.replace(r"\.wav", r"\.\w+")), files) == parts


def test_a_part_that_the_label_determines_and_optional_groups_are_used():
    classes = [
        Path(f"{n:03d} - {name}/{i}.ogg") for n, name in ((1, "Dog"), (2, "Rain")) for i in (1, 2)
    ]
    pattern = re.compile(r"\d+ - (?P<label>[^/]+)/(?P<take>\d)\.ogg")
    assert unused_parts(pattern, classes) == []
    assert unused_parts(pattern, classes[::2]) == [["001 - ", "002 - "]]
    signs = [Path(f"bar_{angle}_{i}.wav") for angle in ("-30", "+10") for i in (1, 2)]
    sign_lost = re.compile(r"bar_.(?P<label>\d+)_(?P<take>\d)\.wav")
    assert unused_parts(sign_lost, signs) == [["bar_+", "bar_-"]]
    optional = re.compile(r"(?P<label>[a-z]+)(?:_(?P<take>\d))?\.wav")
    assert unused_parts(optional, [Path("a.wav"), Path("a_1.wav"), Path("b_1.wav")]) == []


def test_a_pattern_that_ignores_a_part_is_a_warning(ajgdata, src, rows):
    write(src, [f"bar_{angle}_{i}.wav" for angle in (-30, 30) for i in (1, 2)])
    command = ("import", src, "--dataset", "mine", "--pattern")
    printed = ajgdata(*command, r"bar_-?(?P<label>\d+)_(?P<grasp>\d)\.wav")
    assert printed.code == 3
    assert (
        "unused 'bar_', 'bar_-': differ between files in a part that the pattern does not"
        in printed.text
    )
    assert len(rows("mine")) == 4
    printed = ajgdata(*command, r"bar_(?P<label>[-\d]+)_\d\.wav")
    assert printed.code == 3
    assert "unused '_1', '_2'" in printed.text
    used = ajgdata(*command, r"bar_(?P<label>[-\d]+)_(?P<take>\d)\.wav", "--on-change", "labels")
    assert used.code == 0
    assert "unused" not in used.text


def test_the_pattern_of_folders_matches_names_of_all_forms(tmp_path, ajgdata, src, rows):
    write(src, ["red cube/a 1.wav", "red cube/b-2.wav", "ball/1.wav", "ball/x.wav"])
    options, printed = proposals(ajgdata, src)
    assert "(the folder is the label)" in printed.out
    assert ajgdata("import", src, "--dataset", "mine", *options[0]).code == 0
    labels = sorted(row["label"] for row in rows("mine"))
    assert labels == ["ball", "ball", "red cube", "red cube"]
    kit = scan(src, ImportSettings(pattern=options[0][1]), "d")
    assert [file.text("take") for file in kit.files] == ["1", "x", "a 1", "b-2"]


@pytest.mark.parametrize(
    ("pattern", "names", "parts"),
    [
        (r"(?P<label>(?P<sign>-?)\d+)_\d\.wav", ["-30_1", "30_1"], []),
        (r"(?P<label>(?P<sign>-?)\d+)_\d\.wav", ["-30_1", "30_2"], [["_1", "_2"]]),
        (r"x(?P<label>(?P<sign>-?)\d+)_\d\.wav", ["x-30_1", "x30_1", "x7_1"], []),
        (r"[ab](?P<grasp>\d+(?P<side>[lr]?))-(?P<n>\d)\.wav", ["a1l-1", "b1-1"], [["a", "b"]]),
        (r"(?P<label>(?P<a>\d*)(?P<b>[a-z]*))_(?P<n>\d)\.wav", ["1_1", "x_1", "2x_2"], []),
        (r"(?P<label>[a-z]+)(?P<sign>-?)(?P<n>\d)\.wav", ["a1", "b-1", "a-2"], []),
        (r"(?P<label>[a-z]+)(?=(?P<rest>.*))_\d\.wav", ["a_1", "b_1", "a_2"], []),
    ],
)
def test_unused_parts_with_groups_within_groups(pattern, names, parts):
    files = [Path(f"{name}.wav") for name in names]
    assert unused_parts(re.compile(pattern), files) == parts


def test_a_sign_in_a_group_within_the_label_is_imported(ajgdata, src, rows):
    write(src, [f"{label}_{n}.wav" for label in ("-30", "30") for n in (1, 2)])
    pattern = r"(?P<label>(?P<sign>-?)\d+)_(?P<grasp>\d)\.wav"
    imported = ajgdata("import", src, "--dataset", "mine", "--pattern", pattern)
    assert "4 added" in imported.text
    assert sorted(row["label"] for row in rows("mine")) == ["-30", "-30", "30", "30"]
