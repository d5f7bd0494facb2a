"""Your own robot: body, parts, states, chart."""
