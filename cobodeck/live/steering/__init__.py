"""The operator on pages, in the process of the run: what commands do, and what pages are told."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
