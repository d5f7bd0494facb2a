"""One rule for the names of all files; none of them leads out of the folder that was asked for."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

from cobodeck.__main__ import main
from cobodeck.project.named_files import KINDS
from cobodeck.terminal.console import FAILED, OK

ROOT = Path(__file__).resolve().parents[3]
FILES = {
    "chart": "charts/inform.yaml",
    "scene": "hw/scenes/hall.yaml",
    "robot": "hw/robots/rbkairos_ur10.yaml",
    "profile": "charts/profiles/tuned.yaml",
    "user": "hw/users/cornering.yaml",
    "prop": "hw/props/prop.yaml",
    "calibration": "hw/calibrations/robotnik_ur10.yaml",
    "arm": "hw/arms/ur10.yaml",
    "connection": "cobodeck/template/robot/PROJECT/rover_udp.yaml",
    "tracking": "hw/trackings/nominal.yaml",
    "campaign": "cobodeck/campaign/files/hasty.yaml",
    "topics": "cobodeck/manual/examples/topics.yaml",
}
NO_NAMES = ["../../out", "a/b", r'"a\\b"', r'"a\e[2J"', "a b", "C:a", "-a", "9a", "..", "ä"]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", NO_NAMES)
@pytest.mark.few(40)
def test_every_kind_of_file_has_a_name_that_is_one(
    kind: str, name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree((ROOT / FILES[kind]).parent, tmp_path / "files")
    file = tmp_path / "files" / Path(FILES[kind]).name
    head, *lines = file.read_text().splitlines(keepends=True)
    while not head.startswith(f"{kind}:"):  # the editor's line of a chart
        head = lines.pop(0)
    file.write_text("".join((f"{kind}: {name}\n", *lines)))

    assert main(["validate", str(file)]) == FAILED

    told = capsys.readouterr().out
    assert f"{file.name}:1:" in told
    assert "letters, digits and _, not starting with a digit" in told


def test_whatever_files_are_called_a_run_writes_into_its_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    here, odd = tmp_path / "some" / "where" / "down" / "here", tmp_path / "a b\x1b[2J;.."
    here.mkdir(parents=True)
    odd.mkdir()
    monkeypatch.chdir(here)
    file = {kind: str(odd / f"-..{kind}\x1b.yaml") for kind in ("chart", "scene", "profile")}
    for kind, target in file.items():
        shutil.copy(ROOT / FILES[kind], target)
    walk = odd / "..\x1b walk.csv"
    walk.write_text("id,t,x,y\n" + "".join(f"1,{0.1 * n:.1f},{n % 9},5\n" for n in range(40)))
    before = everything(tmp_path)
    beside = ["--profile", file["profile"], "--user", f"{os.path.relpath(walk)}@7,7,0"]

    assert main(["simulate", "chase", "--scene", "hall", *beside, "--duration", "1"]) == OK
    assert main(["simulate", file["chart"], "--scene", file["scene"], "--duration", "1"]) == OK
    assert main(["render", "--scene", file["scene"]]) == OK
    assert main(["render", file["chart"]]) == OK

    new = everything(tmp_path) - before
    assert len(new) == 4
    assert all(path.is_relative_to(here) for path in new), new


def everything(folder: Path) -> set[Path]:
    return {Path(place) / name for place, _, files in os.walk(folder) for name in files}
