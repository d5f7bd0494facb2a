"""What a run was worth: evaluators on the true state, metrics, figures."""
