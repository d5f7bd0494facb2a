"""Benchmarks of localization: simulated drives, real logs, peers."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
