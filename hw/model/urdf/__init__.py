"""Arms read from URDF: the tree of links, the chain of an arm, and capsules around its shapes."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
