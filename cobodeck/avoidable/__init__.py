"""Which touches of robot and person could have been avoided: an exhaustive search of motions."""
