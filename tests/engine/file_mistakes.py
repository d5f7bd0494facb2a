"""Mistakes that people make in scenes, users, robots and profiles; as in `chart_mistakes`."""

# ruff: noqa: E501  a mistake per line

SCENE = """\
scene: room
about: A room with a wall in it.
room:
  outer: [[0.0, 0.0], [10.0, 0.0], [10.0, 9.0], [0.0, 9.0]]
  walls:
    - [[4.0, 8.0], [4.2, 8.0], [4.2, 9.0], [4.0, 9.0]]
robot: {file: rbkairos_ur10, start: {x: 8.0, y: 6.0, yaw: 3.1}}
user: {source: demo, start: {x: 5.0, y: 4.0, yaw: 1.571}}
parking:
  corner: {x: 1.15, y: 7.0, yaw: -0.785}
"""
USER = """\
user: someone
about: Walks about and asks for a touch.
speed: 1.1
repeat: true
steps:
  - stand: 3
  - walk: {x: 4.6, y: 3.2, yaw: 1.9}
  - request: {hold: 10, ahead: 0.8, height: 1.3}
"""

_OUTER = "[[0.0, 0.0], [10.0, 0.0], [10.0, 9.0], [0.0, 9.0]]"

SCENES = [
    ("a length in seconds", "x: 8.0, y: 6.0", "x: ¦8 s, y: 6.0", "in mm, cm, m, km"),
    ("a length in metres", "x: 8.0, y: 6.0", "x: ¦8 metres, y: 6.0", "8 m"),
    ("yaw in degrees without a unit", "yaw: 3.1}", "yaw: ¦180}", "180 deg"),
    ("yaw in degrees, by another word", "yaw: 3.1}", "yaw: ¦180 degrees}", "180 deg"),
    ("decimal comma", "x: 8.0, y: 6.0", "x: ¦8,0, y: 6.0", "8.0"),
    ("a misspelt key", "parking:\n", "¦parkign:\n", "'parking'"),
    ("a singular key", "  walls:\n", "  ¦wall:\n", "'walls'"),
    ("a key in capitals", "robot: {file", "¦Robot: {file", "'robot'"),
    ("a Cyrillic key", "robot: {file", "¦r\u043ebot: {file", "Cyrillic"),
    ("an unknown robot", "rbkairos_ur10", "¦rbkairos_ur1", "'rbkairos_ur10'"),
    ("a robot with the wrong ending", "rbkairos_ur10", "¦rbkairos_ur10.yml", "'rbkairos_ur10'"),
    ("an unknown user", "source: demo", "source: ¦dmeo", "'demo'"),
    ("a coordinate missing", "start: {x: 8.0, y: 6.0, yaw", "¦start: {x: 8.0, yaw", "'y' is missing"),
    ("a point of one number", "[10.0, 9.0], [0.0, 9.0]]\n  w", "¦[10.0], [0.0, 9.0]]\n  w", "2 values"),
    ("too few corners", f"outer: {_OUTER}", "¦outer: [[0.0, 0.0], [10.0, 0.0]]", "3"),
    ("an unclosed [", "[[4.0, 8.0], [4.2, 8.0], [4.2, 9.0], [4.0, 9.0]]", "¦[[4.0, 8.0]", "`]`"),
    ("the robot in a wall", "start: {x: 8.0, y: 6.0", "¦start: {x: 4.1, y: 8.5", "free floor"),
    ("the robot outside", "start: {x: 8.0, y: 6.0", "¦start: {x: 80.0, y: 6.0", "free floor"),
    ("a tab", "  corner:", "¦\tcorner:", "not with tabs"),
    ("a colon in text", "A room with", "Room¦: with", "quotes"),
]  # fmt: skip

USERS = [
    ("a duration in sec", "stand: 3", "stand: ¦3 sec", "3 s"),
    ("a length for a duration", "stand: 3", "stand: ¦3 m", "a duration"),
    ("repeat: yes", "repeat: true", "repeat: ¦yes", "`true`"),
    ("repeat: on", "repeat: true", "repeat: ¦on", "`true`"),
    ("repeat: True", "repeat: true", "repeat: ¦True", "`true`"),
    ("step: for steps:", "steps:\n", "¦step:\n", "'steps'"),
    ("an unknown step", "walk: {x", "¦wlak: {x", "'walk'"),
    ("a step without a dash", "  - stand: 3\n", "  ¦stand: 3\n", "`- `"),
    ("a speed in metres", "speed: 1.1", "speed: ¦1.1 m", "a speed"),
    ("a speed of a car", "speed: 1.1", "speed: ¦50", "50 is out of range"),
    ("a missing coordinate", "walk: {x: 4.6, y: 3.2, yaw", "¦walk: {x: 4.6, yaw", "'y' is missing"),
    ("nothing for steps", USER[USER.index("steps:") :], "steps:¦\n", "a list"),
]  # fmt: skip

ROBOTS = [
    ("a mass in pounds", "mass: 130.0", "mass: ¦290 lb", "a mass, in kg, g"),
    ("a mass in capitals", "mass: 130.0", "mass: ¦130 KG", "130 kg"),
    ("a negative mass", "mass: 130.0", "mass: ¦-130", "out of range"),
    ("an unknown mode", "[omni, differential]", "[¦omny, differential]", "'omni'"),
    ("an unknown prop", "prop: prop ", "prop: ¦porp ", "'prop'"),
    ("a misspelt key", "payload:", "¦payloda:", "'payload'"),
    ("a rate in seconds", "odometry: {rate: 50 Hz}", "odometry: {rate: ¦50 s}", "a frequency"),
    ("a number as text", "length: 1.13", 'length: ¦"1.13 meter"', "1.13 m"),
]  # fmt: skip

PROFILES = [
    ("a speed in metres", "base_speed: 3.0 m/s", "base_speed: ¦3.0 m", "a speed"),
    ("m/s for m/s2", "base_acceleration: 1.5 m/s2", "base_acceleration: ¦1.5 m/s", "m/s2"),
    ("m/s^2", "base_acceleration: 1.5 m/s2", "base_acceleration: ¦1.5 m/s^2", "1.5 m/s2"),
    ("mps", "base_speed: 3.0 m/s", "base_speed: ¦3.0 mps", "3.0 m/s"),
    ("a switch that is on", "governor: false", "governor: ¦off", "`false`"),
    ("a misspelt section", "navigation:  ", "¦navigaton:  ", "'navigation'"),
    ("per cent in words", "across: 5 %", "across: ¦5 percent", "5 %"),
    ("an angle in degrees", "half_view: 36 deg", "half_view: ¦36", "36 deg"),
]  # fmt: skip
