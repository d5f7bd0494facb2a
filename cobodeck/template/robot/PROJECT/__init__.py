"""A robot of one's own: body, parts, states, chart."""
