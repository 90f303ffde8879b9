"""The device side of each wire: what the host sent and the time go in; what such a device would say comes out."""
