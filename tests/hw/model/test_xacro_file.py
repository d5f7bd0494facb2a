"""xacro is expanded where its package is; what is recorded is the expansion."""

import builtins
import sys
from pathlib import Path

import pytest

from engine.files.finding import FileError
from engine.files.text import instead, noting
from hw.model.urdf.xacro_file import is_xacro, urdf_text

HEAD = '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="own">\n'
ARM = (
    HEAD + '<xacro:property name="reach" value="0.5"/>\n'
    '<xacro:macro name="part" params="at"><link name="${at}"/></xacro:macro>\n'
    '<xacro:part at="base"/><xacro:part at="tip"/>\n'
    '<joint name="turn" type="revolute"><parent link="base"/><child link="tip"/>\n'
    '<origin xyz="0 0 ${2 * reach}"/></joint>\n</robot>\n'
)


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    file = tmp_path / "own.urdf.xacro"
    file.write_text(ARM)
    return file


@pytest.fixture
def no_xacro(monkeypatch: pytest.MonkeyPatch) -> None:
    """As if the package were not installed."""
    found = builtins.__import__

    def without(name: str, *rest: object, **more: object) -> object:
        if name == "xacro":
            raise ModuleNotFoundError("No module named 'xacro'", name="xacro")
        return found(name, *rest, **more)  # type: ignore[arg-type]

    monkeypatch.delitem(sys.modules, "xacro", raising=False)
    monkeypatch.setattr(builtins, "__import__", without)


def test_without_the_package_the_error_says_how_to_get_it(arm: Path, no_xacro: None) -> None:
    with pytest.raises(FileError) as refused:
        urdf_text(arm)

    told = str(refused.value)
    assert told.startswith(str(arm))
    assert "needs the package xacro: pip install 'cobodeck[urdf]'" in told
    assert "xacro own.urdf.xacro > own.urdf" in told


def test_what_has_no_macros_needs_no_package(tmp_path: Path, no_xacro: None) -> None:
    plain = '<robot name="own"><!-- ${was} <xacro:part/> --><link name="base"/></robot>'
    for name in ("own.xacro", "own.urdf"):
        (tmp_path / name).write_text(plain)
        assert urdf_text(tmp_path / name) == plain
    assert not is_xacro(plain)
    assert is_xacro(ARM)


def test_macros_are_expanded_and_a_replay_needs_no_package(
    arm: Path, request: pytest.FixtureRequest
) -> None:
    pytest.importorskip("xacro", reason="needs the extra urdf")
    with noting() as read:
        text = urdf_text(arm)
    assert '<link name="base"/>' in text.replace(" />", "/>")
    assert 'xyz="0 0 1.0"' in text
    assert "xacro:" not in text

    request.getfixturevalue("no_xacro")
    arm.unlink()
    with instead(read):
        assert urdf_text(arm) == text


@pytest.mark.parametrize(
    ("old", "new", "line", "told"),
    [
        ("${2 * reach}", "${2 * rech}", 6, "rech"),
        ('<xacro:part at="tip"/>', '<xacro:prt at="tip"/>', 4, "xacro:prt"),
        ("</joint>", "</jint>", 6, "mismatched tag"),
    ],
)
def test_mistakes_have_their_line(arm: Path, old: str, new: str, line: int, told: str) -> None:
    pytest.importorskip("xacro", reason="needs the extra urdf")
    arm.write_text(ARM.replace(old, new))

    with pytest.raises(FileError) as refused:
        urdf_text(arm)

    assert str(refused.value).startswith(f"{arm}:{line}:")
    assert told in str(refused.value)
