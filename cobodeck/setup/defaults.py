"""What a run takes where nothing else is named."""

SCENE, PROFILE = "lab_a", "tuned"
TICK_HZ = 30
