"""JSON Schema of chart files, for editors."""
