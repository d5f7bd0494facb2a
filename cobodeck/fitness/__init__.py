"""Is this machine, room, robot, chart fit to run: the checks and who asks them."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
