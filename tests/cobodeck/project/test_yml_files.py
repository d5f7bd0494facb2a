"""`.yml` is as good an ending as `.yaml`, for every kind of file a project has."""

from pathlib import Path

import pytest

from cobodeck.__main__ import main
from cobodeck.manual.file_entries import EXAMPLES
from cobodeck.terminal.console import FAILED, OK

FILES = {
    "robot": "robot: rover\nmass: 35 kg\npayload: 0 kg\n"
    "footprint: {length: 60 cm, width: 45 cm, foam: 2 cm, enclosing_radius: 40 cm}\n"
    "base: {modes: [differential], max_speed: 1 m/s, max_yaw_rate: 2 rad/s, half_track: 18 cm,\n"
    "  brake_deceleration: 1.5 m/s2, command_timeout: 0.3 s, wheel_radius: 7 cm,\n"
    "  rolling_resistance: 0.03}\n",
    "room": "scene: room\nroom: {outer: [[0, 0], [9, 0], [9, 7], [0, 7]]}\n"
    "robot: {file: rover, start: {x: 2, y: 2, yaw: 0}}\nuser: {source: guest}\n"
    "places: {gate: {x: 3, y: 3}}\n",
    "annex": "scene: annex\nroom: room\nrobot: {file: ./robot.yml, start: {x: 2, y: 2, yaw: 0}}\n",
    "user": "user: guest\nstart: {x: 6, y: 4, yaw: 180 deg}\nsteps:\n  - stand: 5\n",
    "profile": "profile: calm\nbase: tuned\nrobot: {base_speed: 0.8 m/s}\n",
    "calmer": "profile: calmer\nbase: calm\nrobot: {base_speed: 0.5 m/s}\n",
    "link": "connection: link\nmodel: ./robot.yml\nscene: room\n"
    'parts: {base: {driver: "ours.states:Nothing"}}\n',
    "inner": "chart: inner\noutcomes: [done]\nstates:\n"
    "  a: {watch: Wait, with: {time: 1 s}, next: {over: .done}}\n",
    "outer": "chart: outer\noutcomes: [done]\nstates:\n  a: {use: inner, next: {done: .done}}\n",
}

STATES = """
class Nothing:
    signals = ()

    def samples(self, now_ns):
        return []

    def stop(self):
        pass
"""


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "pyproject.toml").write_text(
        '[project]\nname = "ours"\nversion = "1"\n\n[project.entry-points."cobodeck.states"]\n'
        'ours = "ours.states"\n'
    )
    package = tmp_path / "ours"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "states.py").write_text(STATES)
    for name, text in FILES.items():
        (package / f"{name}.yml").write_text(text)
    monkeypatch.chdir(tmp_path)
    return package


@pytest.mark.slow
def test_all_are_found_by_name_and_checked(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["validate"]) == OK, capsys.readouterr().out
    assert f"no errors in {len(FILES)} files" in capsys.readouterr().out
    run = "simulate outer --scene annex --profile calmer --duration 2"
    assert main(run.split()) == OK
    assert "done" in capsys.readouterr().out


def test_a_mistake_in_any_is_found(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name, text in FILES.items():
        (project / f"{name}.yml").write_text(text + "nonsense: 1\n")
    assert main(["validate"]) == FAILED
    told = capsys.readouterr().out
    for name, text in FILES.items():
        assert f"{name}.yml:{len(text.splitlines()) + 1}:1: error" in told


@pytest.mark.slow
@pytest.mark.parametrize(
    "kind", ["arm", "calibration", "connection", "prop", "topics", "tracking", "user"]
)
def test_the_example_of_a_kind_is_read_and_a_mistake_in_it_found(
    kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (EXAMPLES / f"{kind}.yaml").read_text(encoding="utf-8")
    file = tmp_path / f"own_{kind}.yml"
    file.write_text(text, encoding="utf-8")
    assert main(["validate", "--no-project", str(file)]) == OK, capsys.readouterr().out
    file.write_text(text + "nonsense: 1\n", encoding="utf-8")
    assert main(["validate", "--no-project", str(file)]) == FAILED
    assert f"own_{kind}.yml:" in capsys.readouterr().out
