"""The answers of the checks, by subject: machine, robot, room, profile, connection, run."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
