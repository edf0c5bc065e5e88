"""What a designer reads out of a trajectory. Pure functions of a finished run; nothing here computes motion."""
