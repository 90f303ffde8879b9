"""Attaching to a run: `rig console`, and in a browser, where who has the token gets a console process of his own."""
