"""What recorded runs tell about their charts: statistics, edges taken, cases for tests."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
