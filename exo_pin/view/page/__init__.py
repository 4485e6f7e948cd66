"""The Meshcat page: overlay, panels, live server, pictures through a browser, recordings."""
