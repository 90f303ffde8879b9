"""`rig devices`: a port or bus goes in; who is there comes out, in sentences and as a bench file to start from."""
