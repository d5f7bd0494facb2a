"""A stock RB-KAIROS through rosbridge."""
