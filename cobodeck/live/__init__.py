"""The live page: what a run, a record or a chart looks like in a browser, and an operator's tools."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
