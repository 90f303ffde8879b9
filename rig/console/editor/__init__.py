"""The campaign editor on the screen: a form at the left, the dry run of what is in it at the right. Opens no device."""
