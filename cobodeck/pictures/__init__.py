"""Pictures of rooms seen from above, as the paper's figures 5 to 7."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
