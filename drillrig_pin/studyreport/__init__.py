"""One page that says everything about a study: what was varied, what came out, which case to look at."""
