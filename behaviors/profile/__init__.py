"""Settings of the behaviours, and the profiles that set them."""
