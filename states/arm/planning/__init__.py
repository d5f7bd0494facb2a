"""Collision-free arm motions, and what the arm can reach."""
