"""Opening a wire: serial settings or a CAN interface go in; characters, lines or frames and their times come out.

The only modules of drivers that touch `serial` and `can`; what the bytes mean is the business of the devices beside it.
"""
