"""Arms read from URDF and from robot files."""
