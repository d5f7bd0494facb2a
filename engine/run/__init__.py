"""One run of a chart: ticks, entering and leaving, waiting, the trace."""
