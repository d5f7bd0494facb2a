import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hw.document import FileError, parse_document, read_document


def parse(text):
    return parse_document(text, "file.yaml")


def test_values_keep_their_line_and_dotted_key():
    item = parse("a: 1\nb:\n  c: [1.5, 1e3]\n").mapping()["b"].mapping()["c"]
    assert item.numbers() == (1.5, 1000.0)
    assert (item.line, item.items()[1].key) == (3, "b.c[1]")


def test_only_true_and_false_are_booleans():
    content = parse("a: on\nb: yes\nc: true\nd: '5'\n").mapping()
    assert [content[k].value for k in "abcd"] == ["on", "yes", True, "5"]


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("a: 1\na: 2\n", 2, "'a' stands twice, first in line 1"),
        ("a: &x 1\nb: 2\n", 1, "anchors"),
        ("a: 1\nb: *x\n", 2, "anchors"),
        ("a: !!python/object:os.system 1\n", 1, "tags"),
        ("a: [1,\nb: 2\n", 3, "not YAML"),
        ("[1]: 2\n", 1, "a key must be a word"),
        ("", 1, "is empty"),
        ("a: 1\n---\nb: 1\n", 2, "second document"),
        ("a: \x01\n", 0, "not YAML"),
    ],
)
def test_wrong_form_is_named_with_its_line(text, line, message):
    with pytest.raises(FileError) as caught:
        parse(text)
    assert caught.value.line == line
    assert message in str(caught.value)


def test_twenty_thousand_levels_are_refused_without_a_crash():
    with pytest.raises(FileError, match="nested deeper"):
        parse("[" * 20_000)


@pytest.mark.parametrize(
    ("text", "call", "message"),
    [
        ("a: wide\n", lambda i: i.number(), "file.yaml:1: a: needs a number, not 'wide'"),
        ("a: true\n", lambda i: i.number(), "needs a number, not True"),
        ("a: -1\n", lambda i: i.number(low=0.0), "at least 0 is needed"),
        ("a: 1e999\n", lambda i: i.number(), "not a finite number"),
        ("a: " + "9" * 5000 + "\n", lambda i: i.number(), "not a finite number"),
        ("a: [1e9, 2]\n", lambda i: i.point(), "too far away"),
        ("a: {x: 1e9, y: 2}\n", lambda i: i.pose(), "1e+09 is out of range"),
        ("a: [1, 2]\n", lambda i: i.numbers(3), "needs 3 numbers, has 2"),
        ("a: {x: 1}\n", lambda i: i.pose(), "the key 'y' is missing"),
        ("a: {x: 1, y: 2, yav: 3}\n", lambda i: i.pose(), "did you mean 'yaw'?"),
        ("a: omny\n", lambda i: i.text(("omni", "differential")), "did you mean 'omni'?"),
        ("a: 5\n", lambda i: i.text(), "needs a text"),
        ("a: 5\n", lambda i: i.items(), "needs a list"),
        ("a:\n", lambda i: i.mapping(), "needs a mapping (key: value), not nothing"),
    ],
)
def test_a_wrong_value_is_named_with_what_would_be_right(text, call, message):
    with pytest.raises(FileError) as caught:
        call(parse(text).mapping()["a"])
    assert message in str(caught.value)


def test_files_that_cannot_be_read_are_errors_of_the_file(tmp_path):
    with pytest.raises(FileError, match="cannot be read"):
        read_document(tmp_path / "missing.yaml")
    with pytest.raises(FileError, match="cannot be read"):
        read_document(tmp_path)
    (tmp_path / "binary.yaml").write_bytes(b"a: 1\nb: \xff\xfe\n")
    with pytest.raises(FileError, match=r"binary.yaml:2: is not text"):
        read_document(tmp_path / "binary.yaml")
    (tmp_path / "large.yaml").write_bytes(b"#" * 1_000_001)
    with pytest.raises(FileError, match="larger than 1 MB"):
        read_document(tmp_path / "large.yaml")


@settings(deadline=None, max_examples=200)
@given(st.text(max_size=200))
def test_any_text_is_a_document_or_a_file_error(text):
    try:
        found = parse(text).path
    except FileError as failure:
        found = failure.path
    assert found == "file.yaml"
