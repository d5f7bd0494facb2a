"""States that compute with the data of a chart: states alone."""
