"""The simulated hand: fingers, the sensor behind them, and what they can pick up."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
