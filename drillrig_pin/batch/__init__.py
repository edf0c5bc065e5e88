"""Many cases at once: studies, the cases they unfold into, workers that solve them, the table they end in."""
