"""What tests of charts and states use."""
