"""One page that says everything about a run, for readers who never saw the code."""
