"""ODrive motor controllers on CAN (CANSimple)."""
