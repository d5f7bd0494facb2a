"""Moving the arm."""
