"""Which touches of robot and person could have been avoided: an exhaustive search of motions."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
