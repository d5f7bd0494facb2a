"""The safety chain of the base, and what shares its wheels."""
