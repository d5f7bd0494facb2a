"""The one loop: wiring, samples to signals, the plant, ticks, clocks."""
