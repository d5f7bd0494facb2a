"""Abilities: plain algorithms, and one states.py in each folder."""
