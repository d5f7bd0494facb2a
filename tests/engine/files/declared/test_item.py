"""Values with their places: strict YAML, errors at the place, files that name others."""

from pathlib import Path

import pytest
from hypothesis import given, settings, strategies as st

from engine.files.declared.item import Item, find_file, gather, load_yaml, parse_yaml
from engine.files.finding import FileError, Place, mistake
from tests.repeats import examples


def parse(text: str) -> Item:
    return parse_yaml(text, "file.yaml", lambda item: item)


def findings(text: str, read=lambda item: item):
    with pytest.raises(FileError) as caught:
        parse_yaml(text, "file.yaml", read)
    return caught.value.findings


def test_values_keep_their_place_and_dotted_key():
    item = parse("a: 1\nb:\n  c: [1.5, 1e3]\n").inner("b.c.1")
    assert (item.value, item.key) == (1000.0, "b.c[1]")
    assert item.place == Place("file.yaml", 3, 12, 15)


def test_mappings_and_lists_stand_where_their_key_does():
    item = parse("a: 1\nb:\n  c: [1.5, 1e3]\n")
    assert item.inner("b").place == Place("file.yaml", 2, 1, 2)
    assert item.inner("b.c").place == Place("file.yaml", 3, 3, 4)


def test_what_is_not_there_is_told_at_the_nearest_around_it():
    item = parse("a: {b: 1}\n")
    assert item.inner("a.x.y").key == "a"
    assert item.inner("x").key == ""


def test_only_true_and_false_are_booleans():
    content = parse("a: on\nb: yes\nc: true\nd: '5'\n").mapping()
    assert [content[k].value for k in "abcd"] == ["on", "yes", True, "5"]


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("a: 1\na: 2\n", 2, "key 'a' stands here again"),
        ("a: &x 1\nb: 2\n", 1, "anchor &x"),
        ("a: 1\nb: *x\n", 2, "alias *x"),
        ("a: !!python/object:os.system 1\n", 1, "tag"),
        ("a: [1,\nb: 2\n", 1, "not YAML"),
        ("a:\n\tb: 1\n", 2, "not YAML"),
        ("[1]: 2\n", 1, "a key must be a word"),
        ("", 1, "is empty"),
        ("a: 1\n---\nb: 1\n", 2, "second document"),
        ("a: \x01\n", 1, "a character that YAML forbids"),
        ("a: 1e999\n", 1, "too large for a number"),
    ],
)
def test_wrong_form_is_named_with_its_line(text, line, message):
    (finding,) = findings(text)
    assert finding.place.line == line
    assert message in finding.message


def test_a_tab_in_the_indentation_is_called_by_its_name():
    assert findings("a:\n\tb: 1\n")[0].hint == "indent with spaces, not with tabs"
    assert findings("a: [1,\nb: 2\n")[0].hint == "close it with `]`"


def test_twenty_thousand_levels_are_refused_without_a_crash():
    for text in ("[" * 20_000, "[" * 500, "[\n" * 20_000):
        (finding,) = findings(text)
        assert (finding.code, finding.message) == ("Y06", "nested deeper than 64 levels")


def test_mistakes_of_form_and_of_content_are_told_together():
    def read(item: Item) -> None:
        raise item.inner("b").error("is wrong", "make it right")

    found = findings("a: 1\na: 2\nb: 3\n", read)
    assert [finding.place.line for finding in found] == [2, 3]


def test_the_text_of_an_error_has_a_line_for_each_mistake():
    def read(item: Item) -> None:
        gather([parse("a: 1\n").mapping()["a"].items, item.inner("b").mapping])

    with pytest.raises(FileError) as caught:
        parse_yaml("b: 3\n", "other.yaml", read)
    assert str(caught.value).splitlines() == [
        "file.yaml:1:4: a: needs a list, not 1",
        "other.yaml:1:4: b: needs a mapping (key: value), not 3",
    ]


def test_an_error_survives_the_way_between_processes():
    import pickle

    error = pickle.loads(pickle.dumps(mistake("file.yaml", "is wrong", 3)))
    assert str(error) == "file.yaml:3:1: is wrong"


def test_a_mistake_in_a_named_file_is_told_there_with_a_note_of_who_named_it(tmp_path):
    other = tmp_path / "other.yaml"
    other.write_text("b: [\n")

    def read(item: Item) -> None:
        inner = item.inner("a")
        inner.refer(lambda: load_yaml(Path(inner.target()), lambda found: found))

    (tmp_path / "file.yaml").write_text("a: ./other.yaml\n")
    with pytest.raises(FileError) as caught:
        load_yaml(tmp_path / "file.yaml", read)
    (finding,) = caught.value.findings
    assert finding.place.file == str(other)
    assert finding.related == ((Place(str(tmp_path / "file.yaml"), 1, 4, 16), "named here"),)


def test_a_file_that_is_not_there_is_told_where_it_is_named(tmp_path):
    def read(item: Item) -> None:
        inner = item.inner("a")
        inner.refer(lambda: load_yaml(Path(inner.target()), lambda found: found))

    (tmp_path / "file.yaml").write_text("a: lost.yaml\n")
    with pytest.raises(FileError, match=r"file\.yaml:1:4: a: .*lost\.yaml: cannot be read"):
        load_yaml(tmp_path / "file.yaml", read)


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        ("name", "name"),
        ("name.yaml", "folder/name.yaml"),
        ("../x/name", "folder/../x/name"),
        ("walk.csv#3@1,2,0.5", "folder/walk.csv#3@1,2,0.5"),
        ("/etc/passwd.yaml", "/etc/passwd.yaml"),
        ("random:deaf at 0.5 m/s", "random:deaf at 0.5 m/s"),
        ("random at 50cm/s", "random at 50cm/s"),
        ("look at/walk", "folder/look at/walk"),
    ],
)
def test_paths_are_told_from_the_folder_of_the_file_and_names_stay_names(written, meant):
    item = parse_yaml(f"a: '{written}'\n", "folder/file.yaml", lambda found: found.inner("a"))
    assert item.target() == meant


def test_a_name_is_looked_up_in_its_folder(tmp_path):
    (tmp_path / "room.yaml").touch()
    assert find_file("room", tmp_path, "scene") == tmp_path / "room.yaml"
    assert find_file("other/room.yaml", tmp_path, "scene") == Path("other/room.yaml")
    with pytest.raises(FileError, match="rom: no such scene; did you mean 'room'"):
        find_file("rom", tmp_path, "scene")


@settings(deadline=None, max_examples=examples(200))
@given(st.text(max_size=200))
def test_any_text_is_a_document_or_a_file_error(text):
    try:
        found = parse(text).place
    except FileError as failure:
        found = failure.findings[0].place
    assert found.file == "file.yaml"
    assert min(found[1:]) >= 1
