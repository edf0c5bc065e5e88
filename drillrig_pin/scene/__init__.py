"""A machine in motion as plain shapes and arrays: what is drawn, where, when. Knows no viewer and no page."""
