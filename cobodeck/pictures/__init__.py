"""Pictures of rooms seen from above, as the paper's figures 5 to 7."""
