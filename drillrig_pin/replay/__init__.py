"""Scenes in the browser: Meshcat's viewer, a page around it, a server for the live one, a video of it."""
