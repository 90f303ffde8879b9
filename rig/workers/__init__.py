"""Work in processes of its own: children that answer lines, lanes that ask them, a folder locked, an end in order."""
