"""A rover with two driven wheels and casters, one scanner and no arm, as its file says it."""

from pathlib import Path

from hw.model.robot import RobotModel, load_robot

FILE = """\
robot: runner
about: Two driven wheels and casters, one scanner ahead, no arm.
mass: 40 kg
payload: 0 kg
footprint: {length: 60 cm, width: 45 cm, foam: 2 cm, enclosing_radius: 40 cm}
base:
  modes: [differential]
  max_speed: 1.2 m/s
  max_yaw_rate: 2.0 rad/s
  brake_deceleration: 1.5 m/s2
  command_timeout: 300 ms
  wheel_radius: 7.5 cm
  half_track: 18 cm
  rolling_resistance: 0.03
sensing:
  lidars:
    scanner:
      {mount: {x: 0.2, y: 0, z: 0.25}, beams: 541, field_of_view: 270 deg, rate: 12.5 Hz,
       min_range: 0.05, max_range: 30.0}
  odometry: {rate: 50 Hz}
  imu: {rate: 50 Hz}
"""


def runner(folder: Path, old: str = "", new: str = "") -> RobotModel:
    """The rover, with a text of its file replaced."""
    assert old in FILE
    file = folder / "runner.yaml"
    file.write_text(FILE.replace(old, new) if old else FILE)
    return load_robot(file)
