"""The console in a browser: requests of strangers come in, those with the token get a console process each."""
