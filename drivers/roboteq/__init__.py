"""Roboteq brushed and brushless controllers over serial text commands."""
