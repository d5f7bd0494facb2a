"""What a run is made of before it starts: scene, options, compiled code, checks."""
