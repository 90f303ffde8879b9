"""What a threshold is, all of them by name, what their false alarms add up to, and the page that lists them."""
