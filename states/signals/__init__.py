"""The user's motion, estimated and predicted, and the states that watch signals."""
